// Scans that are read beside the work on the ones before.
#include "scan_feed.hpp"

#include <atomic>
#include <future>
#include <gtest/gtest.h>

namespace octosurf::test {
namespace {

/// Waits in its first next() until it is let go, and notes if it is asked anything meanwhile.
class SlowSource : public ScanSource {
 public:
  SlowSource(std::promise<void>& begun, std::shared_future<void> go_on, bool& disturbed)
      : begun_(begun), go_on_(std::move(go_on)), disturbed_(disturbed) {}

  std::size_t size() const override {
    if (reading_) disturbed_ = true;
    return 7;
  }
  std::optional<Scan> next() override {
    if (given_ == 0) {
      reading_ = true;
      begun_.set_value();
      go_on_.wait();
      reading_ = false;
    }
    return given_++ < 7 ? std::optional<Scan>(Scan{}) : std::nullopt;
  }
  const std::vector<std::string>& skipped() const override { return skipped_; }

 private:
  std::promise<void>& begun_;
  std::shared_future<void> go_on_;
  bool& disturbed_;
  std::atomic<bool> reading_ = false;
  int given_ = 0;
  std::vector<std::string> skipped_;
};

TEST(ScanFeed, ItsSourceIsAskedNothingWhileItReads) {
  std::promise<void> begun, go_on;
  bool disturbed = false;
  ScanFeed feed(std::make_unique<SlowSource>(begun, go_on.get_future().share(), disturbed), {1, 2, 100});
  begun.get_future().wait();
  const std::size_t size = feed.size();
  go_on.set_value();
  std::size_t scans = 0;
  while (feed.next()) ++scans;
  EXPECT_FALSE(disturbed);
  EXPECT_EQ(size, 3U) << "the second, fourth and sixth of seven";
  EXPECT_EQ(scans, size);
}

TEST(ScanFeed, PeeksAtTheNextScan) {
  std::promise<void> begun, go_on;
  go_on.set_value();
  bool disturbed = false;
  ScanFeed feed(std::make_unique<SlowSource>(begun, go_on.get_future().share(), disturbed), {0, 1, 1});
  const Scan* first = feed.peek();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(feed.peek(), first);
  EXPECT_TRUE(feed.next());
  EXPECT_EQ(feed.peek(), nullptr) << "the end";
}

TEST(ScanFeed, LeavesOutWhatIsNotAcceptedAndCountsItAsTaken) {
  std::promise<void> begun, go_on;
  go_on.set_value();
  bool disturbed = false;
  std::atomic<int> looked_at{0};
  ScanFeed feed(std::make_unique<SlowSource>(begun, go_on.get_future().share(), disturbed), {1, 1, 5}, 2,
                [&](Scan&) { return ++looked_at > 2; });
  std::size_t scans = 0;
  while (feed.next()) ++scans;
  EXPECT_EQ(scans, 3U) << "five after the first, of which two are refused";
  EXPECT_EQ(feed.refused(), 2U);
}

/// Of 7 scans, all or every second: each number of parts covers what the whole has, each scan once.
TEST(ScanFeed, PartsTogetherAreEachScanOnce) {
  /// Names its scans 0 to 6.
  class Numbered : public ScanSource {
   public:
    std::size_t size() const override { return 7; }
    std::optional<Scan> next() override {
      if (given_ == 7) return {};
      Scan scan;
      scan.name = std::to_string(given_++);
      return scan;
    }
    const std::vector<std::string>& skipped() const override { return skipped_; }

   private:
    int given_ = 0;
    std::vector<std::string> skipped_;
  };
  const auto names_of = [](const ScanRange& range) {
    ScanFeed feed(std::make_unique<Numbered>(), range);
    std::vector<std::string> names;
    while (const auto scan = feed.next()) names.push_back(scan->name);
    EXPECT_EQ(names.size(), feed.size());
    return names;
  };
  for (const ScanRange& whole : {ScanRange{}, ScanRange{1, 2, 100}, ScanRange{0, 1, 5}})
    for (std::size_t parts = 1; parts <= 9; ++parts) {
      std::vector<std::string> together;
      for (std::size_t part = 1; part <= parts; ++part) {
        ScanRange range = whole;
        range.part = part;
        range.parts = parts;
        for (const std::string& name : names_of(range)) together.push_back(name);
      }
      EXPECT_EQ(together, names_of(whole)) << parts << " parts";
    }
}

}  // namespace
}  // namespace octosurf::test
