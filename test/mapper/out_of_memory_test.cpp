// What is left of a map when memory runs out in the middle of a scan: the mapper as it was, or one that
// refuses everything from then on.
#include "mapper/failing_memory.hpp"
#include "support/guarantees.hpp"
#include "support/random_scans.hpp"
#include "support/sanitized.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <iterator>
#include <optional>
#include <random>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <octosurf/adapters/detail/parallel.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

Parameters coarse() {
  Parameters parameters;
  parameters.occupancy.resolution = 0.05;
  return parameters;
}

/// Scans inside a room whose walls stand elsewhere from the fifth on: points vanish, surfaces are born, grow,
/// shrink and go.
std::vector<Scan> changing_room(std::size_t count) {
  std::mt19937_64 rng(20);  // fixed: the same allocations are there to fail in each run
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < count; ++i)
    scans.push_back(test::room_scan(rng, 2500, {i < 5 ? 0.9 : 1.3, 1.1, 0.7}, {0.3, -0.2, 0.1}));
  return scans;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What a child process found out, in memory that it shares with its parent.
struct Finding {
  std::size_t allocations, failed;
  bool threw, refused;  // the insert; the calls after it
  char problem[160];

  void complain(const char* text) {
    if (problem[0] == 0) std::strncpy(problem, text, sizeof problem - 1);
  }
};

class OutOfMemory : public ::testing::Test {
 protected:
  OutOfMemory() {
    std::string name = (fs::temp_directory_path() / "octosurf-memory-XXXXXX").string();
    folder = mkdtemp(name.data());
    void* shared = mmap(nullptr, sizeof(Finding), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) throw std::bad_alloc();
    finding = static_cast<Finding*>(shared);
  }
  ~OutOfMemory() override {
    munmap(finding, sizeof(Finding));
    fs::remove_all(folder);
  }

  /// `before` are mapped; then one more scan is inserted while the allocation after `n` more fails, then
  /// three more, and what there is is saved. All of that in a child process, whose end is told in words if
  /// it is a crash.
  std::string crash_of(const std::function<void()>& work) const {
    *finding = {};
    const pid_t child = fork();
    if (child == 0) {
      try {
        work();
      } catch (const std::exception& error) {
        finding->complain(error.what());
        _exit(1);
      }
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFSIGNALED(status)) return std::string("killed by ") + strsignal(WTERMSIG(status));
    return WEXITSTATUS(status) == 0 ? "" : "exit code " + std::to_string(WEXITSTATUS(status));
  }

  fs::path folder;
  Finding* finding = nullptr;
};

/// A mapper with some scans in it, the scan during which memory runs out, the three after it; and what the
/// map must be in the end with and without the one.
class Story {
 public:
  Story(const std::vector<Scan>& scans, std::size_t before, int threads)
      : next(scans[before]),
        later(scans.begin() + static_cast<std::ptrdiff_t>(before) + 1, scans.end()),
        mapper(coarse(), threads) {
    Mapper whole(coarse(), threads), without(coarse(), threads);
    for (std::size_t i = 0; i < scans.size(); ++i) {
      whole.insert(scans[i]);
      if (i != before) without.insert(scans[i]);
      if (i < before) mapper.insert(scans[i]);
    }
    with_it = test::digest(whole.map());
    without_it = test::digest(without.map());
    stood = test::digest(mapper.map());
  }

  /// Runs in the child. The good file `good` must stay as it is if the map is broken.
  void tell(std::size_t n, bool all_after, const fs::path& good, Finding& finding) {
    const Map& held = mapper.map();
    const auto snapshot = mapper.snapshot();
    const std::size_t asked = test::allocations();
    test::fail_allocation_after(n, all_after);
    finding.threw = throws([&] { mapper.insert(next); });
    finding.failed = test::stop_failing();
    finding.allocations = test::allocations() - asked;
    if (finding.threw != (mapper.snapshot() == snapshot))
      finding.complain("the snapshot is not the one of what was mapped");
    std::size_t refused = 0;
    for (const Scan& scan : later) refused += throws([&] { mapper.insert(scan); });
    finding.refused = refused > 0;
    if (finding.refused && mapper.snapshot() != snapshot) finding.complain("the snapshot has changed");
    if (finding.refused)
      broken(refused, held, good, finding);
    else
      sound(good.parent_path() / "after", finding);
  }

 private:
  /// Nothing but an Error or bad_alloc may come.
  static bool throws(const std::function<void()>& work) {
    try {
      work();
    } catch (const Error&) {
      return true;
    } catch (const std::bad_alloc&) {
      return true;
    }
    return false;
  }

  void broken(std::size_t refused, const Map& held, const fs::path& good, Finding& finding) {
    if (!finding.threw) finding.complain("a scan that was taken has broken the map");
    if (refused != later.size()) finding.complain("some calls are refused, some are not");
    if (!throws([&] { mapper.detect_in_occupancy(); })) finding.complain("detect_in_occupancy() works on it");
    if (!throws([&] { mapper.map(); })) finding.complain("map() gives it");
    if (!throws([&] { check_invariants(held); })) finding.complain("it is checked");
    if (!throws([&] { save_map(held, good); })) finding.complain("it is saved");
    if (!throws([&] { static_cast<void>(std::move(mapper).release()); })) finding.complain("it is released");
    mapper = Mapper();  // destroys it
  }

  void sound(const fs::path& stem, Finding& finding) {
    if (test::digest(mapper.map()) != (finding.threw ? without_it : with_it))
      finding.complain("the map is another one");
    if (!check_invariants(mapper.map()).empty()) finding.complain("invariants are broken");
    save_map(mapper.map(), stem);
    if (test::digest(load_map(stem).map) != test::digest(mapper.map()))
      finding.complain("it is not saved as it is");
  }

  Scan next;
  std::vector<Scan> later;
  std::string with_it, without_it;

 public:
  Mapper mapper;
  std::string stood;
};

class FailedAllocations : public OutOfMemory {
 protected:
  /// `count` failures, spread over all the allocations of one insert, each in a process of its own.
  void expect_refused_or_right(Story& story, std::size_t count, bool all_after) {
    const fs::path good = folder / "good";
    save_map(story.mapper.map(), good);
    const std::string saved = bytes_of(folder / "good.surfaces"), bt = bytes_of(folder / "good.bt");
    constexpr std::size_t none = 1U << 30;
    ASSERT_EQ(crash_of([&] { story.tell(none, false, good, *finding); }), "");
    ASSERT_STREQ(finding->problem, "");
    ASSERT_FALSE(finding->threw || finding->refused);
    const std::size_t all = finding->allocations;
    ASSERT_GT(all, count) << "too small a scan for so many";
    std::size_t struck = 0, refused = 0, unharmed = 0;
    std::mt19937_64 rng(test::seed());
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t first = all * i / count, last = all * (i + 1) / count - 1;
      // The very first one comes before anything is touched; one of them must.
      const std::size_t n = i == 0 ? 0 : std::uniform_int_distribution(first, last)(rng);
      const std::string crash = crash_of([&] { story.tell(n, all_after, good, *finding); });
      EXPECT_EQ(crash, "") << "allocation " << n << " of " << all;
      EXPECT_STREQ(finding->problem, "") << "allocation " << n << " of " << all;
      EXPECT_TRUE(bytes_of(folder / "good.surfaces") == saved && bytes_of(folder / "good.bt") == bt)
          << "a good file was saved over; allocation " << n << " of " << all;
      struck += finding->failed > 0;
      refused += finding->refused;
      unharmed += finding->threw && !finding->refused;
      if (::testing::Test::HasFailure() && i > count / 10) break;
    }
    std::cout << struck << " of " << count << " failures struck, among " << all << " allocations: " << refused
              << " times the map was given up, " << unharmed << " times the scan was refused\n";
    if (::testing::Test::HasFailure()) return;
    EXPECT_EQ(struck, count);
    EXPECT_GT(refused, count / 4) << "most of a scan's allocations come after the octree is touched";
    EXPECT_GT(unharmed, 0U) << "and some before";
  }
};

TEST_F(FailedAllocations, EachOfManyIsRefusedOrRight) {
  const char* given = std::getenv("OCTOSURF_FAILED_ALLOCATIONS");  // few, so that the suite stays fast
  Story story(changing_room(10), 6, 1);
  expect_refused_or_right(story, given != nullptr ? std::stoul(given) : 150, false);
}

TEST_F(FailedAllocations, MemoryThatStaysOutIsNoWorse) {
  Story story(changing_room(10), 6, 1);
  expect_refused_or_right(story, 60, true);
}

TEST_F(FailedAllocations, InTheFirstScan) {
  Story story(changing_room(4), 0, 1);
  expect_refused_or_right(story, 60, false);
}

TEST_F(FailedAllocations, WithTwoThreads) {
  Story story(changing_room(10), 6, 2);
  expect_refused_or_right(story, 60, false);
}

TEST_F(OutOfMemory, AMergerIsRefusedOrRight) {
  const std::vector<Scan> scans = changing_room(8);
  Mapper mapper(coarse()), other(coarse()), whole(coarse());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (i >= 4) other.insert(scans[i]);
    if (i < 4) mapper.insert(scans[i]);
    if (i < 4) whole.insert(scans[i]);
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = 0.31;
  const std::string stood = test::digest(mapper.map());
  whole.merge(other.map(), T);
  const std::string merged = test::digest(whole.map());
  // In the child; with the allocation after `n` more failing.
  const auto tell = [&](std::size_t n) {
    const std::size_t asked = test::allocations();
    test::fail_allocation_after(n, false);
    try {
      mapper.merge(other.map(), T);
    } catch (const std::bad_alloc&) {
      finding->threw = true;
    }
    finding->failed = test::stop_failing();
    finding->allocations = test::allocations() - asked;
    try {
      if (test::digest(mapper.map()) != (finding->threw ? stood : merged))
        finding->complain("the map is another one");
    } catch (const Error&) {
      finding->refused = true;
      if (!finding->threw) finding->complain("a merger that went well has broken the map");
    }
  };
  constexpr std::size_t none = 1U << 30, count = 60;
  ASSERT_EQ(crash_of([&] { tell(none); }), "");
  ASSERT_STREQ(finding->problem, "");
  const std::size_t all = finding->allocations;
  std::size_t refused = 0, unharmed = 0;
  std::mt19937_64 rng(test::seed());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t n =
        i == 0 ? 0 : std::uniform_int_distribution(all * i / count, all * (i + 1) / count - 1)(rng);
    EXPECT_EQ(crash_of([&] { tell(n); }), "") << "allocation " << n << " of " << all;
    EXPECT_STREQ(finding->problem, "") << "allocation " << n << " of " << all;
    refused += finding->refused;
    unharmed += finding->threw && !finding->refused;
  }
  EXPECT_GT(refused, 0U) << "when the octree has been touched";
  EXPECT_GT(unharmed, 0U) << "before";
}

TEST_F(OutOfMemory, ThreadsThatAreNotGrantedAreDoneWithout) {
  if (test::sanitized) GTEST_SKIP() << "a sanitizer needs more address space than the limit leaves";
  const std::string crash = crash_of([&] {
    rlimit none{};
    ::getrlimit(RLIMIT_AS, &none);
    none.rlim_cur = 0;  // no room for another stack
    ::setrlimit(RLIMIT_AS, &none);
    std::vector<std::thread::id> done(8);
    detail::in_parallel(8, [&](int t) { done[static_cast<std::size_t>(t)] = std::this_thread::get_id(); });
    finding->refused = std::count(done.begin(), done.end(), std::thread::id()) == 0 &&
                       std::count(done.begin(), done.end(), std::this_thread::get_id()) > 1;
  });
  EXPECT_EQ(crash, "");
  EXPECT_TRUE(finding->refused) << "all shares are done, and more than its own by the caller";
}

}  // namespace
}  // namespace octosurf
