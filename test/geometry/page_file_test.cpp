// What is kept in a file is what was written, whenever it is dropped from memory.
#include "geometry/page_file.hpp"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::geometry {
namespace {

using Numbers = std::vector<std::uint64_t, PagedAllocator<std::uint64_t>>;

/// Grows and shrinks vectors at random, and compares them with their twins on the heap.
void churn(unsigned seed) {
  std::mt19937 rng(seed);
  std::vector<Numbers> paged(50);
  std::vector<std::vector<std::uint64_t>> twins(50);
  for (int step = 0; step < 3000; ++step) {
    const std::size_t i = rng() % paged.size();
    if (rng() % 8 == 0) {
      paged[i] = {};
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

TEST(PageFile, AFolderThatIsNoneIsAnErrorThatNamesIt) {
  try {
    PageFile::open("/no/such/folder");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("/no/such/folder"), std::string::npos) << error.what();
  }
}

TEST(PageFile, KeepsWhatIsWrittenWhileOtherThreadsDropIt) {
  const Numbers before(1000, 7);  // from the heap, and goes back there
  const auto folder =
      std::filesystem::temp_directory_path() / ("octosurf-pages-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  PageFile::open(folder);
  EXPECT_TRUE(std::filesystem::is_empty(folder)) << "a crash would leave it";
  EXPECT_THROW(PageFile::open(folder), Error);
  std::atomic<bool> done = false;
  std::thread dropping([&] {
    for (std::size_t keep = 0; !done; keep = (keep + 4096) % (std::size_t{1} << 20)) PageFile::drop(keep);
  });
  std::thread other([] { churn(1); });
  churn(2);
  other.join();
  done = true;
  dropping.join();
  void* const block = PageFile::allocate(100);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % 64, 0u);
  PageFile::deallocate(block, 100);
  EXPECT_EQ(PageFile::allocate(100), block) << "freed blocks are reused";
  std::filesystem::remove(folder);
}

}  // namespace
}  // namespace octosurf::geometry
