// What python_insert.py is measured against: the seconds that Mapper::insert takes over a recording.
#include <chrono>
#include <cstdio>

#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

int main(int count, char** arguments) {
  if (count != 2) return 2;
  octosurf::Mapper mapper;
  const auto source = octosurf::open_scans({arguments[1]});
  std::chrono::duration<double> inserting{};
  while (const auto scan = source->next()) {
    const auto begin = std::chrono::steady_clock::now();
    mapper.insert(*scan);
    inserting += std::chrono::steady_clock::now() - begin;
  }
  std::printf("%.6f\n", inserting.count());
}
