// What python_insert.py is measured against: for each line that comes, inserts the recording's next scan and
// says how long that took on the clock and on the processor, s.
#include <chrono>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <string>

#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace {

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  octosurf::Mapper mapper;
  const auto source = octosurf::open_scans({arguments[1]});
  std::string line;
  for (auto scan = source->next(); scan && std::getline(std::cin, line); scan = source->next()) {
    const auto begin = std::chrono::steady_clock::now();
    const double begin_s = processor_s();
    mapper.insert(*scan);
    const double busy_s = processor_s() - begin_s;
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    std::printf("%.9f %.9f\n", took.count(), busy_s);
    std::fflush(stdout);
  }
}
