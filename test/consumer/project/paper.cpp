// A board, by the detector of the paper.
#include <cstdio>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/mapper.hpp>

int main() {
  octosurf::Scan scan;
  for (int u = -50; u <= 50; ++u)
    for (int v = -50; v <= 50; ++v) scan.points.emplace_back(0.01F * u, 0.01F * v, 1.0F);
  octosurf::Mapper mapper(octosurf::Parameters::paper(), 1, octosurf::paper_detector());
  mapper.insert(scan);
  std::printf("%zu surface by the paper's detector\n", mapper.snapshot()->surfaces.size());
}
