// `octosurf diff` on maps of a table that is taken away.
#include "apps/command.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <cmath>
#include <gmock/gmock.h>

#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Diff : public CommandTest {
 protected:
  /// before: a floor and a table; after: resumed without the table; other: another map, of the floor alone.
  Diff() {
    made_once("table" + std::to_string(seed()), [this] { make(); });
  }
  void make() const {
    std::mt19937_64 random = rng();
    Scene empty, full;
    empty.rectangle({-1.5, -1.5, 0}, {3, 0, 0}, {0, 3, 0});
    full = empty;
    full.box({-0.4, -0.3, 0}, {0.4, 0.3, 0.4});
    const auto look = [&](const Scene& scene, int i) {
      const double a = 0.7 * i;
      return camera_scan(scene, look_at({1.6 * std::cos(a), 1.6 * std::sin(a), 1.4}, {0, 0, 0.1}), random);
    };
    Parameters coarse;
    coarse.occupancy.resolution = 0.04;
    Mapper mapper(coarse), other(coarse);
    for (int i = 0; i < 9; ++i) mapper.insert(look(full, i));
    save_map(mapper.map(), folder / "before");
    for (int i = 0; i < 18; ++i) mapper.insert(look(empty, i));
    save_map(mapper.map(), folder / "after");
    for (int i = 0; i < 9; ++i) other.insert(look(empty, i));
    save_map(other.map(), folder / "other");
  }
  json told(const std::string& arguments) const {
    return json::parse(run_well("diff --json " + arguments).out);
  }
};

TEST_F(Diff, TellsByIdsWhatWentAndWhatGrew) {
  const json difference = told("before after");
  EXPECT_EQ(difference.at("revision_before"), 9);
  EXPECT_EQ(difference.at("revision_after"), 27);
  double gone = 0, grown = 0;
  for (const json& one : difference.at("gone")) gone += one.at("area_m2").get<double>();
  for (const json& one : difference.at("changed"))
    grown += one.at("area_after_m2").get<double>() - one.at("area_before_m2").get<double>();
  EXPECT_NEAR(gone, 0.48 + 2 * 0.4 * (0.8 + 0.6), 0.4) << "its top and its sides";
  EXPECT_NEAR(grown, 0.48, 0.15) << "the floor under it";
  EXPECT_THAT(run_well("diff before after").out, HasSubstr("revision 9 to 27"));
}

TEST_F(Diff, TheSameMapHasNotChanged) {
  const json difference = told("before before");
  for (const char* list : {"appeared", "changed", "gone", "merged", "split"})
    EXPECT_TRUE(difference.at(list).empty()) << list;
}

TEST_F(Diff, MapsThatDoNotGoOnFromOneAnotherAreRefused) {
  EXPECT_THAT(error_of("diff before other", 1),
              AllOf(HasSubstr("other: does not go on from before"), HasSubstr("--resume before -o other")));
  EXPECT_THAT(error_of("diff after before", 1), HasSubstr("does not go on from after"));
  EXPECT_THAT(error_of("diff before nothing", 1), HasSubstr("nothing"));
}

}  // namespace
}  // namespace octosurf::test
