// What map files say of surfaces that are no more: comes back, and cannot be made up.
#include "map_files.hpp"
#include "surfaces/map_state.hpp"

#include <octosurf/changes.hpp>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;
using Removals = MapFiles;

TEST_F(Removals, ComeBackWithWhoTookThemIn) {
  Map map = map_of(pillar(30, 20));  // it is taken away
  save_map(map, folder / "a");
  const LoadedMap loaded = load_map(folder / "a");
  EXPECT_EQ(difference(map, loaded.map), "");
  std::size_t told = 0;
  for (std::uint64_t since = 0; since <= map.snapshot()->revision; ++since) {
    const MapChanges saved = changes_since(*map.snapshot(), since),
                     now = changes_since(*loaded.map.snapshot(), since);
    EXPECT_EQ(now.gone, saved.gone);
    EXPECT_EQ(now.merged, saved.merged);
    EXPECT_EQ(now.split, saved.split);
    EXPECT_EQ(now.appeared, saved.appeared);
    EXPECT_EQ(now.cylinders_gone, saved.cylinders_gone);
    told += saved.gone.size() + saved.merged.size() + saved.cylinders_gone.size();
  }
  EXPECT_GT(told, 0U);
}

TEST_F(Removals, ManyComeBackInOrder) {
  Map map = map_of(changing_room(5));
  std::vector<Removal> many;
  const SurfaceId first = surfaces::state_of(map).surfaces.next_id();
  for (SurfaceId i = 0; i < 20000; ++i)
    many.push_back({Removal::Of::surface, first + i, i % 3 == 0 ? 1U : 0U, i / 9000, 1 + i / 8000, {1, 2}});
  surfaces::state_of(map).surfaces.set_next_id(first + 20000);
  surfaces::state_of(map).removals = RemovalLog().with(many);
  save_map(map, folder / "a");
  const LoadedMap loaded = load_map(folder / "a");
  std::vector<Removal> read;
  loaded.map.snapshot()->removals.for_each_since(0, [&](const Removal& d) { read.push_back(d); });
  EXPECT_EQ(read, many);
}

TEST_F(Removals, ThatCannotBeAreRefused) {
  std::vector<map_file::Record> good = unpack(bytes_of(map_of(changing_room(6))));
  std::erase_if(good, [](const map_file::Record& record) {
    return record.has_removals() || record.has_seen_patches();
  });
  const std::uint32_t next = good.front().header().next_id();
  const std::uint64_t revision = good.front().header().revision();
  const auto with = [&](const std::function<void(map_file::Removal&, map_file::Removal&)>& spoil) {
    std::vector<map_file::Record> records = good;
    records.front().mutable_header()->set_next_id(next + 2);
    map_file::Removals& removals = *records.emplace_back().mutable_removals();
    for (std::uint32_t i = 0; i < 2; ++i) {
      map_file::Removal& removal = *removals.add_removals();
      removal.set_id(next + i);
      removal.set_born(1);
      removal.set_revision(2 + i);
      removal.add_parents(1);
    }
    spoil(*removals.mutable_removals(0), *removals.mutable_removals(1));
    return loading(pack(records));
  };
  using D = map_file::Removal;
  EXPECT_EQ(with([](D&, D&) {}), "loaded");
  EXPECT_THAT(with([](D& a, D&) { a.clear_id(); }), HasSubstr("never there"));
  EXPECT_THAT(with([&](D&, D& b) { b.set_id(next + 2); }), HasSubstr("never there"));
  EXPECT_THAT(with([](D& a, D&) { a.set_cylinder(true); }), HasSubstr("never there"));
  EXPECT_THAT(with([&](D& a, D&) { a.set_id(last_surface(good).id()); }), HasSubstr("has not gone"));
  EXPECT_THAT(with([&](D&, D& b) { b.set_id(next); }), HasSubstr("gone twice"));
  EXPECT_THAT(with([&](D& a, D&) { a.set_into(next); }), HasSubstr("into what never was"));
  EXPECT_THAT(with([&](D& a, D&) { a.set_into(next + 2); }), HasSubstr("into what never was"));
  EXPECT_THAT(with([&](D&, D& b) { b.set_revision(revision + 1); }), HasSubstr("out of order"));
  EXPECT_THAT(with([](D&, D& b) { b.set_revision(1); }), HasSubstr("out of order"));
  EXPECT_THAT(with([](D& a, D&) { a.set_born(5); }), HasSubstr("out of order"));
  EXPECT_THAT(with([](D& a, D&) { a.add_parents(0); }), HasSubstr("parent that never was"));
  EXPECT_THAT(with([&](D& a, D&) { a.add_parents(next + 2); }), HasSubstr("parent that never was"));
}

}  // namespace
}  // namespace octosurf::test
