#include "surfaces/atomic_shared_ptr.hpp"

#include "support/testing.hpp"

namespace octosurf::surfaces {
namespace {

/// Two numbers that are never seen apart.
struct Pair {
  int first, second;
};

TEST(AtomicSharedPtr, ReadersSeeWholeValuesThatNeverGoBack) {
  constexpr int last = 20000;
  AtomicSharedPtr<const Pair> pointer(std::make_shared<const Pair>(Pair{0, 0}));
  std::vector<int> wrong(4, 0);
  {
    std::vector<std::jthread> readers;
    for (int& mistakes : wrong)
      readers.emplace_back([&pointer, &mistakes] {
        for (int seen = 0; seen < last;) {
          const std::shared_ptr<const Pair> pair = pointer.load();
          mistakes += pair->first != pair->second || pair->first < seen;
          seen = pair->first;
        }
      });
    for (int i = 1; i <= last; ++i) pointer.store(std::make_shared<const Pair>(Pair{i, i}));
  }
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

TEST(AtomicSharedPtr, KeepsNothingButTheLastValue) {
  auto first = std::make_shared<const Pair>(Pair{1, 1});
  const std::weak_ptr<const Pair> watched = first;
  AtomicSharedPtr<const Pair> pointer(std::move(first));
  std::shared_ptr<const Pair> held = pointer.load();
  pointer.store(std::make_shared<const Pair>(Pair{2, 2}));
  EXPECT_FALSE(watched.expired()) << "a reader holds it";
  held.reset();
  EXPECT_TRUE(watched.expired());
  EXPECT_EQ(pointer.load()->first, 2);
}

}  // namespace
}  // namespace octosurf::surfaces
