// A map's history as a file: what comes back, and what damage does.
#include "map_files.hpp"

#include <gmock/gmock.h>

#include <octosurf/history.hpp>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;

class HistoryFile : public MapFiles {
 protected:
  std::string bytes_of(const History& history) const {
    save_history(history, folder / "x.history", true);
    return read_file(folder / "x.history");
  }
  /// The message of its Error(data), "read" if there is none. Any other exception fails the test.
  std::string reading(const std::string& content) const {
    write_file(folder / "x.history", content);
    try {
      load_history(folder / "x.history");
      return "read";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::data);
      return error.what();
    }
  }
};

/// Of maps in which surfaces and a cylinder come, change and go.
History history_of(const std::vector<Scan>& scans, std::shared_ptr<const Snapshot>& last) {
  Mapper mapper(coarse());
  History history;
  for (const Scan& scan : scans) {
    mapper.insert(scan);
    history.add(*mapper.snapshot(), scan.stamp_s);
  }
  last = mapper.snapshot();
  return history;
}

void expect_same(const History& a, const History& b) {
  ASSERT_EQ(a.moments().size(), b.moments().size());
  EXPECT_EQ(a.stride(), b.stride());
  for (std::size_t i = 0; i < a.moments().size(); ++i) {
    const Moment &x = a.moments()[i], &y = b.moments()[i];
    ASSERT_EQ(x.revision, y.revision);
    ASSERT_EQ(x.stamp_s, y.stamp_s);
    ASSERT_EQ(x.surfaces.size(), y.surfaces.size());
    ASSERT_EQ(x.cylinders.size(), y.cylinders.size());
    for (std::size_t k = 0; k < x.surfaces.size(); ++k) {
      const PastSurface &s = *x.surfaces[k], &t = *y.surfaces[k];
      ASSERT_EQ(s.id, t.id);
      ASSERT_EQ(s.born, t.born);
      ASSERT_EQ(s.revision, t.revision);
      ASSERT_EQ(s.color, t.color);
      ASSERT_EQ(s.T_map_surface.matrix(), t.T_map_surface.matrix());
      ASSERT_EQ(s.area_m2, t.area_m2);
      ASSERT_EQ(s.inliers, t.inliers);
      ASSERT_EQ(s.polygons.size(), t.polygons.size());
      for (std::size_t p = 0; p < s.polygons.size(); ++p) {
        ASSERT_EQ(s.polygons[p].outer, t.polygons[p].outer);
        ASSERT_EQ(s.polygons[p].holes, t.polygons[p].holes);
      }
    }
    for (std::size_t k = 0; k < x.cylinders.size(); ++k) {
      const Cylinder &c = *x.cylinders[k], &e = *y.cylinders[k];
      ASSERT_EQ(c.id, e.id);
      ASSERT_EQ(c.axis_point, e.axis_point);
      ASSERT_EQ(c.axis, e.axis);
      ASSERT_EQ(c.start, e.start);
      ASSERT_EQ(c.radius_m, e.radius_m);
      ASSERT_EQ(c.length_m, e.length_m);
      ASSERT_EQ(c.span_rad, e.span_rad);
    }
  }
}

TEST_F(HistoryFile, ComesBackAsItWas) {
  for (const std::vector<Scan>& scans : {changing_room(12), pillar(12, 4)}) {
    std::shared_ptr<const Snapshot> last;
    const History history = history_of(scans, last);
    ASSERT_GT(history.moments().size(), 3U);
    EXPECT_TRUE(history.belongs_to(*last));
    const std::string bytes = bytes_of(history);
    const History again = load_history(folder / "x.history");
    expect_same(history, again);
    EXPECT_EQ(bytes_of(again), bytes);
  }
  EXPECT_EQ(load_history((bytes_of(History()), folder / "x.history")).moments().size(), 0U);
}

TEST_F(HistoryFile, DamagedFilesAreRefused) {
  std::shared_ptr<const Snapshot> last;
  const std::string good = bytes_of(history_of(changing_room(8), last));
  expect_refused_when_damaged(
      good, "is not a map's history", [&](const std::string& bytes) { return reading(bytes); },
      [&] { return bytes_of(load_history(folder / "x.history")); });
  EXPECT_THAT(failure(Error::Kind::data, [&] { load_history(folder / "none"); }),
              HasSubstr("cannot be read"));
}

TEST_F(HistoryFile, IsNotWrittenOverUnasked) {
  save_history(History(), folder / "x.history", false);
  EXPECT_THAT(failure(Error::Kind::usage, [&] { save_history(History(), folder / "x.history", false); }),
              HasSubstr("x.history"));
}

}  // namespace
}  // namespace octosurf::test
