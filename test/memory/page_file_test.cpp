// What is kept in a file is what was written, whenever it is dropped from memory; a limit is its map's alone.
#include "io/files.hpp"
#include "io/map_file/map_file.hpp"
#include "memory/memory_limit.hpp"
#include "support/random_scans.hpp"
#include "support/seed.hpp"

#include <atomic>
#include <cstdint>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::memory {
namespace {

using PageFileTest = test::FolderTest;
using MemoryLimitTest = test::FolderTest;

using Numbers = std::vector<std::uint64_t, PagedAllocator<std::uint64_t>>;

/// Grows and shrinks vectors at random, and compares them with their twins on the heap.
void churn(PageFile* file, unsigned seed) {
  std::mt19937 rng(seed);
  std::vector<Numbers> paged(50, Numbers(file));
  std::vector<std::vector<std::uint64_t>> twins(50);
  for (int step = 0; step < 3000; ++step) {
    const std::size_t i = rng() % paged.size();
    if (rng() % 8 == 0) {
      paged[i] = Numbers(file);
      twins[i].clear();
    }
    for (std::size_t n = std::size_t{1} << rng() % 12; n > 0; --n) {
      paged[i].push_back(rng());
      twins[i].push_back(paged[i].back());
    }
  }
  for (std::size_t i = 0; i < paged.size(); ++i)
    ASSERT_TRUE(std::equal(paged[i].begin(), paged[i].end(), twins[i].begin(), twins[i].end()));
}

std::string bytes_of(const Mapper& mapper) {
  std::ostringstream out;
  io::write_map(mapper.map().state(), {}, out);
  return out.str();
}

TEST_F(PageFileTest, AFolderThatIsNoneIsAnErrorThatNamesIt) {
  try {
    const PageFile file("/no/such/folder");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("/no/such/folder"), std::string::npos) << error.what();
  }
}

TEST_F(PageFileTest, KeepsWhatIsWrittenWhileOtherThreadsDropIt) {
  PageFile file(folder);
  EXPECT_TRUE(std::filesystem::is_empty(folder)) << "a crash would leave it";
  std::atomic<bool> done = false;
  std::thread dropping([&] {
    for (std::size_t keep = 0; !done; keep = (keep + 4096) % (std::size_t{1} << 20)) file.drop(keep);
  });
  std::thread other([&] { churn(&file, 1); });
  churn(&file, 2);
  other.join();
  done = true;
  dropping.join();
  void* const block = file.allocate(100);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % 64, 0u);
  file.deallocate(block, 100);
  EXPECT_EQ(file.allocate(100), block) << "freed blocks are reused";
}

TEST_F(MemoryLimitTest, IsOneMapsAlone) {
  Parameters parameters;
  parameters.occupancy.resolution = 0.1;
  const auto mapper_within = [&](std::size_t bytes) {
    auto limit = std::make_unique<MemoryLimit>(bytes, folder);
    return std::make_unique<Mapper>(Map(std::make_unique<surfaces::MapState>(parameters, std::move(limit))));
  };
  // Less than the program itself takes: whatever can leave leaves every few milliseconds.
  const auto tight = mapper_within(1 << 20), roomy = mapper_within(std::size_t{1} << 40);
  Mapper free(parameters);
  const MemoryLimit& tight_limit = *tight->map().state().limit;
  const MemoryLimit& roomy_limit = *roomy->map().state().limit;
  EXPECT_EQ(free.map().state().limit, nullptr);
  std::mt19937_64 rng = test::rng();
  for (int i = 0; i < 6; ++i) {
    const Scan scan = test::room_scan(rng, 4000, {2, 1.5, 1});
    tight->insert(scan);
    free.insert(scan);
    EXPECT_EQ(roomy_limit.pages()->used(), 0u) << "its file has another map's pages";
  }
  EXPECT_GT(free.map().size().surfaces, 3u);
  EXPECT_GT(tight_limit.pages()->used(), free.map().size().bytes);
  EXPECT_EQ(bytes_of(*tight), bytes_of(free));
  EXPECT_GT(tight_limit.peak(), tight_limit.limit());
  EXPECT_LT(roomy_limit.peak(), roomy_limit.limit());
}

TEST_F(MemoryLimitTest, ViewsOutliveTheMap) {
  auto limit = std::make_unique<MemoryLimit>(1 << 20, folder);
  std::optional<Mapper> mapper(Map(std::make_unique<surfaces::MapState>(Parameters{}, std::move(limit))));
  std::mt19937_64 rng = test::rng();
  mapper->insert(test::room_scan(rng, 2000, {1, 1, 1}));
  const OccupancyView view = mapper->map().octree();
  const std::string data = view.octomap_data();
  mapper.reset();
  EXPECT_EQ(view.octomap_data(), data);
}

}  // namespace
}  // namespace octosurf::memory
