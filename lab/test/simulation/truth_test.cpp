// truth.json: what is saved is read back; anything else is refused with the file's name.
#include "evaluation/truth.hpp"

#include "simulation/fixture.hpp"
#include "simulation/recording.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

namespace fs = std::filesystem;

class TruthFile : public FolderTest {
 protected:
  static evaluation::Truth example(const std::string& scene = "change") {
    SimulationOptions options;
    options.scene = scene;
    options.frames = 2;
    options.seed = 18446744073709551615u;  // fixed: the largest there is
    return Recording(options).truth();
  }

  std::string text() const { return bytes_of(file_); }

  void expect_refused(const std::string& content) const {
    std::ofstream(file_) << content;
    try {
      evaluation::load_truth(file_);
      FAIL() << "was read: " << content.substr(0, 200);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), Error::Kind::data);
      EXPECT_EQ(e.where(), file_.string());
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
  }

  /// The example's text with the first `from` made `to`.
  std::string spoiled(const std::string& from, const std::string& to) const {
    std::string content = text();
    const auto at = content.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return content.replace(at, from.size(), to);
  }

  const fs::path file_ = dir_ / "truth.json";
};

TEST_F(TruthFile, RoundTripLosesNothing) {
  const evaluation::Truth saved = example();
  evaluation::save_truth(saved, file_);
  const evaluation::Truth read = evaluation::load_truth(file_);
  EXPECT_EQ(read.scene, saved.scene);
  EXPECT_EQ(read.sensor, saved.sensor);
  EXPECT_EQ(read.seed, saved.seed);
  EXPECT_EQ(read.cell, saved.cell);
  EXPECT_EQ(read.visible_hits, saved.visible_hits);
  ASSERT_EQ(read.faces.size(), saved.faces.size());
  for (std::size_t f = 0; f < saved.faces.size(); ++f) {
    const evaluation::TrueFace &a = saved.faces[f], &b = read.faces[f];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.plane.normal, b.plane.normal);
    EXPECT_EQ(a.plane.offset, b.plane.offset);
    EXPECT_EQ(a.T_map_face.matrix(), b.T_map_face.matrix());
    EXPECT_EQ(a.gone, b.gone);
    EXPECT_EQ(a.visible_area_m2, b.visible_area_m2);
    ASSERT_EQ(a.polygons.size(), b.polygons.size());
    EXPECT_EQ(a.polygons[0].outer, b.polygons[0].outer);
    EXPECT_EQ(a.polygons[0].holes, b.polygons[0].holes);
    ASSERT_EQ(a.visible.size(), b.visible.size());
    for (std::size_t r = 0; r < a.visible.size(); ++r) {
      EXPECT_EQ(a.visible[r].row, b.visible[r].row);
      EXPECT_EQ(a.visible[r].column, b.visible[r].column);
      EXPECT_EQ(a.visible[r].count, b.visible[r].count);
    }
  }
}

TEST_F(TruthFile, StairsComeBackAndMayBeMissing) {
  const evaluation::Truth saved = example("spiral");
  evaluation::save_truth(saved, file_);
  const evaluation::Truth read = evaluation::load_truth(file_);
  ASSERT_EQ(saved.stairs.size(), 1u);
  ASSERT_EQ(read.stairs.size(), 1u);
  EXPECT_EQ(read.stairs[0].kind, "spiral");
  EXPECT_EQ(read.stairs[0].riser_m, saved.stairs[0].riser_m);
  EXPECT_EQ(read.stairs[0].tread_m, saved.stairs[0].tread_m);
  EXPECT_EQ(read.stairs[0].edges, saved.stairs[0].edges);
  const std::string stairs = spoiled("\"stairs\"", "\"others\"");
  std::ofstream(file_) << stairs;
  EXPECT_TRUE(evaluation::load_truth(file_).stairs.empty());
}

TEST_F(TruthFile, NamesThatAreNoUtf8AreSavedAsFarAsTheyCanBe) {
  evaluation::Truth truth = example();
  truth.scene = "Gel\xE4nde";
  evaluation::save_truth(truth, file_);
  EXPECT_EQ(evaluation::load_truth(file_).scene, "Gel\xEF\xBF\xBDnde");
}

TEST_F(TruthFile, ForeignFilesAreRefused) {
  expect_refused("");
  expect_refused("P5 640 480 65535\n");
  expect_refused("[]");
  expect_refused("{}");
  expect_refused(R"({"format":"octosurf-surfaces","version":1,"surfaces":[]})");
  expect_refused(R"({"format":"octosurf-truth","version":1})");
  expect_refused(std::string(100000, '['));
  EXPECT_THROW(evaluation::load_truth(dir_ / "missing.json"), Error);
  EXPECT_THROW(evaluation::load_truth(dir_), Error);
}

TEST_F(TruthFile, TruncatedFilesAreRefused) {
  evaluation::save_truth(example(), file_);
  const std::string whole = text();
  for (std::size_t cut = 0; cut + 2 < whole.size(); cut += 1 + whole.size() / 60)
    expect_refused(whole.substr(0, cut));
}

TEST_F(TruthFile, DamagedFieldsAreRefused) {
  evaluation::Truth truth = example();
  truth.faces.resize(2);
  truth.faces[0].visible = {{4, 5, 6}};
  truth.faces[0].plane.offset = 0.125;
  evaluation::save_truth(truth, file_);
  const std::vector<std::pair<std::string, std::string>> damages{{"\"version\":1", "\"version\":2"},
                                                                 {"\"cell\":0.01", "\"cell\":-1"},
                                                                 {"\"cell\":0.01", "\"cell\":\"0.01\""},
                                                                 {"\"id\":1,", "\"id\":0,"},
                                                                 {"\"id\":1,", "\"id\":2,"},
                                                                 {"\"id\":1,", "\"id\":1.5,"},
                                                                 {"\"offset\":0.125", "\"offset\":1e999"},
                                                                 {"\"offset\":0.125", "\"offset\":null"},
                                                                 {"\"normal\":[", "\"normal\":[9,"},
                                                                 {"\"T_map_face\":[", "\"T_map_face\":[1,"},
                                                                 {"[4,5,6]", "[4,5,0]"},
                                                                 {"[4,5,6]", "[4,5,99999999999]"},
                                                                 {"[4,5,6]", "[4,5]"},
                                                                 {"\"visible\":", "\"seen\":"},
                                                                 {"\"outer\":[", "\"outer\":[[1]],\"x\":["},
                                                                 {"\"gone\":false", "\"gone\":7"}};
  const std::string whole = text();
  for (const auto& [from, to] : damages) {
    std::ofstream(file_) << whole;
    expect_refused(spoiled(from, to));
  }
}

TEST_F(TruthFile, UnwritablePlaceIsAnError) {
  try {
    evaluation::save_truth(example(), dir_ / "no" / "folder" / "truth.json");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), Error::Kind::output);
  }
}

}  // namespace
}  // namespace octosurf::simulation
