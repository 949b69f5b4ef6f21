// truth.json: what is saved is read back; anything else is refused with the file's name.
#include "evaluation/truth.hpp"

#include "simulation/fixture.hpp"
#include "simulation/recording.hpp"

#include <array>
#include <tuple>

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

  std::string text() const { return read_file(file_); }

  void expect_refused(const std::string& content) const {
    write("truth.json", content);
    SCOPED_TRACE(content.substr(0, 200));
    EXPECT_EQ(refusal(Error::Kind::data, [&] { evaluation::load_truth(file_); }).where(), file_.string());
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
  for (const char* scene : {"change", "spiral"}) {
    const evaluation::Truth saved = example(scene);
    evaluation::save_truth(saved, file_);
    const evaluation::Truth read = evaluation::load_truth(file_);
    const auto header = [](const evaluation::Truth& t) {
      return std::tuple(t.scene, t.sensor, t.seed, t.cell, t.visible_hits, t.faces.size(), t.stairs.size());
    };
    const auto face = [](const evaluation::TrueFace& f) {
      std::vector<std::array<int, 3>> runs;
      for (const auto& run : f.visible) runs.push_back({run.row, run.column, run.count});
      return std::tuple(f.id, f.name, f.gone, f.visible_area_m2, f.plane.normal, f.plane.offset,
                        Eigen::Matrix4d(f.T_map_face.matrix()), f.polygons.size(), f.polygons[0].outer,
                        f.polygons[0].holes, runs);
    };
    ASSERT_EQ(header(read), header(saved));
    for (std::size_t f = 0; f < saved.faces.size(); ++f)
      EXPECT_TRUE(face(read.faces[f]) == face(saved.faces[f])) << f;
    for (std::size_t s = 0; s < saved.stairs.size(); ++s) {
      const evaluation::TrueStair &a = saved.stairs[s], &b = read.stairs[s];
      EXPECT_EQ(std::tie(a.kind, a.riser_m, a.tread_m, a.edges),
                std::tie(b.kind, b.riser_m, b.tread_m, b.edges));
    }
  }
  const std::string without_stairs = spoiled("\"stairs\"", "\"others\"");
  EXPECT_EQ(evaluation::load_truth(file_).stairs.size(), 1u);
  EXPECT_TRUE(evaluation::load_truth(write("truth.json", without_stairs)).stairs.empty());
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
  const std::string whole = text();
  const auto refuse = [&](const std::string& field, std::initializer_list<const char*> damaged) {
    for (const char* instead : damaged) {
      write("truth.json", whole);
      expect_refused(spoiled(field, instead));
    }
  };
  refuse("\"version\":1", {"\"version\":2"});
  refuse("\"cell\":0.01", {"\"cell\":-1", "\"cell\":\"0.01\""});
  refuse("\"id\":1,", {"\"id\":0,", "\"id\":2,", "\"id\":1.5,"});
  refuse("\"offset\":0.125", {"\"offset\":1e999", "\"offset\":null"});
  refuse("\"normal\":[", {"\"normal\":[9,"});
  refuse("\"T_map_face\":[", {"\"T_map_face\":[1,"});
  refuse("[4,5,6]", {"[4,5,0]", "[4,5,99999999999]", "[4,5]"});
  refuse("\"visible\":", {"\"seen\":"});
  refuse("\"outer\":[", {"\"outer\":[[1]],\"x\":["});
  refuse("\"gone\":false", {"\"gone\":7"});
}

TEST_F(TruthFile, UnwritablePlaceIsAnError) {
  refusal(Error::Kind::output,
          [&] { evaluation::save_truth(example(), dir_ / "no" / "folder" / "truth.json"); });
}

}  // namespace
}  // namespace octosurf::simulation
