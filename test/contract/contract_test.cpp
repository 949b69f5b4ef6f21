// What every map keeps, whatever it is of: each promise once, over worlds of every kind.
#include "contract/worlds.hpp"
#include "io/map_file/map_file.hpp"
#include "io/map_file/map_files.hpp"
#include "support/guarantees.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <limits>
#include <random>
#include <span>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Contract : public MapFiles, public ::testing::WithParamInterface<World> {
 protected:
  const World& world = GetParam();
  const Mapped& run = run_of(world);
};

INSTANTIATE_TEST_SUITE_P(Worlds, Contract, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return std::string(each.param.name); });

TEST_P(Contract, InvariantsHoldAfterEveryScan) {
  for (std::size_t i = 0; i < run.wrong.size(); ++i) EXPECT_THAT(run.wrong[i], IsEmpty()) << "scan " << i;
  for (std::size_t i = 0; i < world.shows.size(); ++i)
    EXPECT_GT(run.seen.*world.shows[i], 0U) << "it shows nothing of its point " << i;
  expect_guarantees(run.map);
}

/// Half of the way by one mapper, the rest by another that takes its map over.
TEST_P(Contract, NeitherThreadsNorAMapperAnewChangeAByte) {
  std::optional<Mapper> mapper(std::in_place, world.parameters, 3);
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    if (i == run.scans.size() / 2) mapper.emplace(Map(std::move(*mapper).release()), 2);
    mapper->insert(run.scans[i]);
    if (i % 4 == 3) {
      ASSERT_TRUE(bytes_of(mapper->map()) == run.bytes[i]) << "after scan " << i;
    }
  }
  EXPECT_TRUE(bytes_of(mapper->map()) == run.bytes.back());
  EXPECT_EQ(difference(run.map, mapper->map()), "");
  EXPECT_TRUE(digest(run.map) == digest(mapper->map()));
}

TEST_P(Contract, StopsAfterEveryScanChangeNothing) {
  std::optional<Mapper> resumed(std::in_place, world.parameters);
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const ScanReport report = resumed->insert(run.scans[i]);
    ASSERT_TRUE(bytes_of(resumed->map()) == run.bytes[i]) << "after scan " << i;
    ASSERT_EQ(report.grown, run.grown[i]);
    save_map(resumed->map(), folder / "map");
    LoadedMap loaded = load_map(folder / "map");
    ASSERT_EQ(loaded.warning, "");
    ASSERT_EQ(difference(resumed->map(), loaded.map), "") << "after scan " << i;
    ASSERT_THAT(check_invariants(loaded.map), IsEmpty());
    resumed.emplace(std::move(loaded.map));
  }
  EXPECT_EQ(difference(run.map, resumed->map()), "");
  save_map(resumed->map(), folder / "again");
  save_map(run.map, folder / "unstopped");
  for (const char* ending : {".surfaces", ".bt"})
    for (const char* other : {"again", "unstopped"})
      EXPECT_TRUE(read_file(folder / (std::string("map") + ending)) ==
                  read_file(folder / (std::string(other) + ending)))
          << other << ending;
}

/// The map of the scans in groups of one to three, each time with what `expected` says of the scan after
/// them.
std::string grouped(const World& world, std::span<const Scan> scans, int threads,
                    const std::function<const Scan*(std::size_t)>& expected) {
  std::mt19937_64 groups = rng();
  Mapper mapper(world.parameters, threads);
  for (std::size_t done = 0; done < scans.size();) {
    const std::size_t count = std::min<std::size_t>(1 + groups() % 3, scans.size() - done);
    done += mapper.insert_all(scans.subspan(done, count), [&] { return expected(done + count); }).size();
    EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
  }
  return bytes_of(mapper.map());
}

TEST_P(Contract, WhatIsDoneAheadOfScansThatComeTogetherChangesNothing) {
  const std::span<const Scan> scans = run.scans;
  std::size_t calls = 0;
  const std::string alone = grouped(world, scans, 1, [&](std::size_t) -> const Scan* {
    ++calls;
    return nullptr;
  });
  EXPECT_EQ(calls, 0U) << "one thread can do nothing meanwhile";
  // Every third time another scan than the one that will come.
  const auto expected = [&](std::size_t i) -> const Scan* {
    if (i % 3 == 0) return &scans[i / 2];
    return i < scans.size() ? &scans[i] : nullptr;
  };
  EXPECT_TRUE(grouped(world, scans, 2, expected) == alone);
}

TEST_P(Contract, RefusedScansLeaveTheMapAsItWas) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const double edge = world.parameters.occupancy.resolution * 32768;
  const std::size_t half = run.scans.size() / 2;
  Mapper mapper(world.parameters);
  for (std::size_t i = 0; i < half; ++i) mapper.insert(run.scans[i]);
  const auto snapshot = mapper.snapshot();
  const auto refuse = [&](const std::function<void(Scan&)>& spoil) {
    Scan scan = run.scans[half];
    scan.name = "bad one";
    spoil(scan);
    EXPECT_THAT(failure(Error::Kind::data, [&] { mapper.insert(scan); }), HasSubstr("bad one"));
    EXPECT_TRUE(bytes_of(mapper.map()) == run.bytes[half - 1]);
    EXPECT_EQ(mapper.snapshot(), snapshot);
  };
  refuse([&](Scan& s) { s.T_map_sensor.linear()(0, 0) = nan; });
  refuse([&](Scan& s) { s.T_map_sensor.translation().y() = nan; });
  refuse([&](Scan& s) { s.T_map_sensor.translation().y() = std::numeric_limits<double>::infinity(); });
  refuse([&](Scan& s) { s.T_map_sensor.linear() *= 1.01; });
  refuse([&](Scan& s) { s.T_map_sensor.linear().col(0) *= -1; });
  refuse([&](Scan& s) { s.T_map_sensor.linear().setZero(); });
  refuse([&](Scan& s) { s.T_map_sensor.translation().x() = edge + 1; });
  refuse([&](Scan& s) { s.T_map_sensor.translation().z() = -1e9; });
  for (std::size_t i = half; i < run.scans.size(); ++i) mapper.insert(run.scans[i]);
  EXPECT_TRUE(bytes_of(mapper.map()) == run.bytes.back()) << "it goes on as if nothing had been";
}

}  // namespace
}  // namespace octosurf::test
