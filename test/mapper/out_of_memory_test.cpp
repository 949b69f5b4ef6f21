// What is left of a map when memory runs out in the middle of a scan: what it was before, to the last bit.
#include "geometry/parallel.hpp"
#include "io/map_file/map_files.hpp"
#include "mapper/failing_memory.hpp"
#include "support/guarantees.hpp"

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace octosurf::mapper {
namespace {

namespace fs = std::filesystem;

/// Points vanish, surfaces are born, grow, shrink and go.
std::vector<Scan> changing_room(std::size_t count) {
  // fixed: the same allocations are there to fail in each run
  std::vector<Scan> scans = test::changing_room(count + 2, std::mt19937_64(20));  // fixed: see above
  scans.resize(count);
  return scans;
}

using test::coarse;
using test::read_file;

/// What a child process found out, in memory that it shares with its parent.
struct Finding {
  std::size_t allocations, failed;
  bool threw;
  char problem[160];

  void complain(const char* text) {
    if (problem[0] == 0) std::strncpy(problem, text, sizeof problem - 1);
  }
};

class OutOfMemory : public test::FolderTest {
 protected:
  OutOfMemory() {
    void* shared = mmap(nullptr, sizeof(Finding), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) throw std::bad_alloc();
    finding = static_cast<Finding*>(shared);
  }
  ~OutOfMemory() override { munmap(finding, sizeof(Finding)); }

  /// Does the work in a child process, whose end is told in words if it is a crash.
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

  /// `count` failures, spread over all the allocations of one change, each in a process of its own: in it
  /// tell(n, i) lets the allocation after `n` more fail in round i. `look` judges what the process left.
  void strike(
      std::size_t count, const std::function<void(std::size_t n, std::size_t i)>& tell,
      const std::function<void()>& look = [] {}) {
    constexpr std::size_t none = 1U << 30;
    ASSERT_EQ(crash_of([&] { tell(none, 0); }), "");
    ASSERT_STREQ(finding->problem, "");
    ASSERT_FALSE(finding->threw);
    const std::size_t all = finding->allocations;
    ASSERT_GT(all, count) << "too small a change for so many";
    std::size_t struck = 0, threw = 0;
    std::mt19937_64 rng(test::seed());
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t n = std::uniform_int_distribution(all * i / count, all * (i + 1) / count - 1)(rng);
      SCOPED_TRACE("allocation " + std::to_string(n) + " of " + std::to_string(all));
      EXPECT_EQ(crash_of([&] { tell(n, i); }), "");
      EXPECT_STREQ(finding->problem, "");
      look();
      struck += finding->failed > 0;
      threw += finding->threw;
      if (::testing::Test::HasFailure() && i > count / 10) return;
    }
    std::cout << struck << " of " << count << " failures struck, among " << all << " allocations; " << threw
              << " times the change was taken back\n";
    EXPECT_EQ(struck, count);
    EXPECT_GT(threw, count / 2) << "few allocations can be done without";
  }

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

  /// Runs in the child. `again`: the scan is inserted once more if it failed.
  void tell(std::size_t n, bool all_after, bool again, const fs::path& folder, Finding& finding) {
    const Map& held = mapper.map();
    const auto snapshot = mapper.snapshot();
    const std::size_t asked = test::allocations();
    test::fail_allocation_after(n, all_after);
    finding.threw = throws([&] { mapper.insert(mapper.prepare(next)); });
    // While there is no memory at all the map may not be there either, but nothing worse.
    if (all_after) throws([&] { test::check_invariants(mapper.map()); });
    finding.failed = test::stop_failing();
    finding.allocations = test::allocations() - asked;
    if (finding.threw != (mapper.snapshot() == snapshot))
      finding.complain("the snapshot is not the one of what was mapped");
    if (finding.threw && test::digest(mapper.map()) != stood)
      finding.complain("the map is not the one before the scan");
    if (!test::check_invariants(held).empty()) finding.complain("invariants are broken");
    save_map(held, folder / "saved");
    if (finding.threw && again) mapper.insert(next);
    for (const Scan& scan : later) mapper.insert(scan);
    if (test::digest(mapper.map()) != (finding.threw && !again ? without_it : with_it))
      finding.complain("it goes on as another one");
    if (!test::check_invariants(held).empty()) finding.complain("invariants are broken later");
    save_map(held, folder / "after");
    if (test::digest(load_map(folder / "after").map) != test::digest(held))
      finding.complain("it is not saved as it is");
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

  Scan next;
  std::vector<Scan> later;
  std::string with_it, without_it;

 public:
  Mapper mapper;
  std::string stood;
};

class FailedAllocations : public OutOfMemory {
 protected:
  void expect_taken_back(Story& story, std::size_t count, bool all_after) {
    save_map(story.mapper.map(), folder / "before");
    const std::string bt = read_file(folder / "before.bt");
    const auto look = [&] {
      if (finding->threw) {
        EXPECT_EQ(test::digest(load_map(folder / "saved").map), story.stood) << "not saved as before";
        EXPECT_TRUE(read_file(folder / "saved.bt") == bt);
      }
    };
    strike(
        count, [&](std::size_t n, std::size_t i) { story.tell(n, all_after, i % 2 == 0, folder, *finding); },
        look);
  }
};

TEST_F(FailedAllocations, EachOfManyLeavesTheMapAsItWas) {
  const char* given = std::getenv("OCTOSURF_FAILED_ALLOCATIONS");  // few, so that the suite stays fast
  Story story(changing_room(10), 6, 1);
  expect_taken_back(story, given != nullptr ? std::stoul(given) : 30, false);
}

TEST_F(FailedAllocations, MemoryThatStaysOutIsNoWorse) {
  Story story(changing_room(10), 6, 1);
  expect_taken_back(story, 12, true);
}

TEST_F(FailedAllocations, InTheFirstScanAndWithTwoThreads) {
  Story first(changing_room(4), 0, 1), parallel(changing_room(10), 6, 2);
  expect_taken_back(first, 12, false);
  expect_taken_back(parallel, 12, false);
}

TEST_F(FailedAllocations, WithACylinder) {
  Story story(test::pillar(6, 0, std::mt19937_64(20)), 4, 1);  // fixed: as above
  ASSERT_EQ(story.mapper.snapshot()->cylinders.size(), 1U);
  expect_taken_back(story, 12, false);
}

/// Two mappers that have mapped the same scans.
struct Twins {
  explicit Twins(std::span<const Scan> scans) {
    for (const Scan& scan : scans) {
      struck.insert(scan);
      whole.insert(scan);
    }
  }
  Mapper struck{coarse()}, whole{coarse()};
};

class ChangesTogether : public OutOfMemory {
 protected:
  const std::vector<Scan> scans = changing_room(8);
  Twins twins{std::span(scans).first(4)};
  const Map other = test::map_of({scans.begin() + 4, scans.end()});

  void expect_all_or_nothing(const std::function<void(Mapper&)>& change, std::size_t count) {
    Mapper& mapper = twins.struck;
    const std::string stood = test::digest(mapper.map());
    change(twins.whole);
    const std::string changed = test::digest(twins.whole.map());
    strike(count, [&](std::size_t n, std::size_t) {
      const auto snapshot = mapper.snapshot();
      const std::size_t asked = test::allocations();
      test::fail_allocation_after(n, false);
      try {
        change(mapper);
      } catch (const std::bad_alloc&) {
        finding->threw = true;
      }
      finding->failed = test::stop_failing();
      finding->allocations = test::allocations() - asked;
      if (test::digest(mapper.map()) != (finding->threw ? stood : changed))
        finding->complain("the map is another one");
      if (finding->threw != (mapper.snapshot() == snapshot))
        finding->complain("the snapshot is not the one of what was mapped");
      if (finding->threw) change(mapper);
      if (test::digest(mapper.map()) != changed) finding->complain("the second time brings another map");
    });
  }
};

TEST_F(ChangesTogether, AMergerIsAllOrNothing) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = 0.31;
  expect_all_or_nothing([&](Mapper& mapper) { mapper.merge(other, T); }, 12);
}

TEST_F(ChangesTogether, ScansThatAreMappedTogetherAreAllOrNothing) {
  expect_all_or_nothing([&](Mapper& mapper) { mapper.insert_all(std::span(scans).subspan(4)); }, 12);
}

TEST_F(ChangesTogether, DrainingIsAllOrNothing) {
  Parameters bounded = coarse();
  bounded.detection.detection_budget = 20;
  for (Mapper* mapper : {&twins.struck, &twins.whole}) {
    *mapper = Mapper(bounded);
    std::size_t waiting = 0;
    for (const Scan& scan : changing_room(2)) waiting = mapper->insert(scan).waiting;
    ASSERT_GT(waiting, 0U);
  }
  expect_all_or_nothing([](Mapper& mapper) { mapper.drain(); }, 12);
}

TEST_F(ChangesTogether, SurfacesOfAnOctreeAreAllOrNothing) {
  save_map(other, folder / "octree");
  twins.struck = Mapper(map_from_octomap(folder / "octree.bt", coarse()));
  twins.whole = Mapper(map_from_octomap(folder / "octree.bt", coarse()));
  expect_all_or_nothing([](Mapper& mapper) { mapper.detect_in_occupancy(); }, 16);
}

TEST_F(ChangesTogether, AnOctreeIsTakenOverAllOrNothing) {
  save_map(other, folder / "other");
  const Map octree = map_from_octomap(folder / "other.bt", coarse());
  expect_all_or_nothing([&](Mapper& mapper) { mapper.replace_occupancy(octree); }, 12);
}

TEST_F(OutOfMemory, ThreadsThatAreNotGrantedAreDoneWithout) {
  if (test::sanitized) GTEST_SKIP() << "a sanitizer needs more address space than the limit leaves";
  const std::string crash = crash_of([&] {
    rlimit none{};
    ::getrlimit(RLIMIT_AS, &none);
    none.rlim_cur = 0;  // no room for another stack
    ::setrlimit(RLIMIT_AS, &none);
    std::vector<std::thread::id> done(8);
    geometry::in_parallel(8, [&](int t) { done[static_cast<std::size_t>(t)] = std::this_thread::get_id(); });
    if (std::count(done.begin(), done.end(), std::thread::id()) != 0)
      finding->complain("a share is not done");
    if (std::count(done.begin(), done.end(), std::this_thread::get_id()) <= 1)
      finding->complain("the caller has done its own share only");
  });
  EXPECT_EQ(crash, "");
  EXPECT_STREQ(finding->problem, "");
}

}  // namespace
}  // namespace octosurf::mapper
