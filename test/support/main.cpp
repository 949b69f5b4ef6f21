// main() of every test program, and the worlds of its random tests. With OCTOSURF_TEST_ROUNDS=N each test
// that draws from the seed runs N times; which tests do is known from the first round.
#include "support/seed.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <iostream>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

namespace octosurf::test {
namespace {

class Worlds : public testing::EmptyTestEventListener {
 public:
  std::string program;
  bool in_rounds = false;

  std::uint64_t seed() {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    if (test == nullptr) throw std::logic_error("test::seed() is for running tests only");
    if (!seed_) {
      const char* given = std::getenv("OCTOSURF_TEST_SEED");
      const std::string text = given != nullptr ? given : "1";
      seed_ = text == "random" ? std::random_device{}() : std::stoull(text);
      drawing_.insert(test);
      std::cout << command(*test) << std::endl;  // flushed: the test may crash
    }
    return *seed_;
  }

 private:
  void OnTestIterationStart(const testing::UnitTest&, int iteration) override { round_ = iteration; }
  void OnTestIterationEnd(const testing::UnitTest& all, int) override {
    if (in_rounds && drawing_.empty()) std::exit(all.Passed() ? 0 : 1);  // one round was enough
  }
  void OnTestStart(const testing::TestInfo& test) override {
    seed_.reset();
    if (round_ > 0 && !drawing_.contains(&test)) skip();
  }
  void OnTestEnd(const testing::TestInfo& test) override {
    if (seed_ && test.result()->Failed()) std::cout << "repeat: " << command(test) << std::endl;
  }
  static void skip() { GTEST_SKIP() << "draws nothing: the same in every round"; }
  std::string command(const testing::TestInfo& test) const {
    return "OCTOSURF_TEST_SEED=" + std::to_string(*seed_) + " " + program +
           " --gtest_filter=" + test.test_suite_name() + "." + test.name();
  }

  std::optional<std::uint64_t> seed_;  // of the running test, once it has asked
  std::set<const testing::TestInfo*> drawing_;
  int round_ = 0;
};

Worlds& worlds() {
  static auto* const only = new Worlds;  // gtest owns and deletes it
  return *only;
}

}  // namespace

std::uint64_t seed() { return worlds().seed(); }

}  // namespace octosurf::test

int main(int argc, char** argv) {
  const char* rounds = std::getenv("OCTOSURF_TEST_ROUNDS");
  if (rounds != nullptr) {
    GTEST_FLAG_SET(repeat, std::stoi(rounds));
    GTEST_FLAG_SET(brief, true);
  }
  testing::InitGoogleTest(&argc, argv);
  octosurf::test::worlds().program = argv[0];
  octosurf::test::worlds().in_rounds = rounds != nullptr;
  testing::UnitTest::GetInstance()->listeners().Append(&octosurf::test::worlds());
  return RUN_ALL_TESTS();
}
