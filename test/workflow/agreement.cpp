// agreement MAP MAP: the share of their area that two maps of one place have in common.
#include "support/unshared_area.hpp"

#include <cstdio>

#include <octosurf/map.hpp>

int main(int, char** argv) {
  using namespace octosurf;
  const LoadedMap one = load_map(argv[1]), other = load_map(argv[2]);
  const Snapshot &a = *one.map.snapshot(), &b = *other.map.snapshot();
  std::printf("%.6f\n", 1 - (test::unshared_area(a, b) + test::unshared_area(b, a)) /
                                (test::area_of(a) + test::area_of(b)));
}
