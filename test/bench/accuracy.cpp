// How exact the surfaces are on simulated scenes: with default parameters, with the paper's detector from
// PCL's parts, and by CGAL's region growing and Efficient RANSAC, all on the same scans and scored alike.

#include "bench/bench.hpp"
#include "evaluation/evaluate.hpp"
#include "evaluation/stairs.hpp"

#include <cmath>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/up.hpp>

namespace octosurf::bench {
namespace {

/// One way to get surfaces from scans.
struct Method {
  std::string name;
  Parameters parameters;
  CgalMethod cgal = nullptr;  ///< in place of a Mapper
};

std::vector<Method> methods_of(const Options& options) {
  const double d = options.resolutions.front();
  std::vector<Method> methods{{"ours/default", parameters_at(d, options.set)},
                              {"ours/paper/r=0.15", paper_parameters(d, 0.15)},
                              {"ours/paper/r=0.06", paper_parameters(d, 0.06)},
                              {"cgal/growing", parameters_at(d), cgal_region_growing},
                              {"cgal/ransac", parameters_at(d), cgal_efficient_ransac}};
  if (!options.only.empty())
    std::erase_if(methods, [&](const Method& method) {
      return std::none_of(options.only.begin(), options.only.end(),
                          [&](const std::string& prefix) { return method.name.starts_with(prefix); });
    });
  if (methods.empty()) throw Error(Error::Kind::usage, "--only", "leaves no method", "try ours or cgal");
  return methods;
}

/// Snapshot, and its time: CGAL's is that of normals and planes of all scans' voxels together.
std::pair<Snapshot, double> run_method(const Method& method, const std::vector<Scan>& scans, int threads) {
  if (method.cgal != nullptr) return cgal_surfaces(method.cgal, scans, method.parameters);
  Mapper mapper(method.parameters, threads, paper_detector());
  const double ms = time_ms([&] {
    for (const Scan& scan : scans) mapper.insert(scan);
    mapper.drain();
  });
  return {*mapper.snapshot(), ms};
}

}  // namespace

void accuracy(const Options& options) {
  const std::vector<Method> methods = methods_of(options);
  for_each_recording(options, [&](const Recorded& recorded, const Json& recording) {
    for (const Method& method : methods) {
      const auto [snapshot, ms] = run_method(method, recorded.scans, options.threads);
      const evaluation::Evaluation evaluation = evaluation::evaluate(snapshot, recorded.truth);
      Json row = Json::parse(to_json(evaluation));
      row.update(Json{
          {"method", method.name}, {"scans", recorded.scans.size()}, {"ms", ms}, {"wrong", Json::array()}});
      for (const evaluation::FaceScore& face : evaluation.face_scores)  // judged and not correct
        if (face.verdict != evaluation::TruthVerdict::correct &&
            face.verdict != evaluation::TruthVerdict::not_judged)
          row["wrong"].push_back(face.id);
      if (!options.verbose)
        for (const char* list : {"face_scores", "surface_scores", "hole_scores"}) row.erase(list);
      write(recording, row);
    }
  });
}

void stairs(const Options& options) {
  for_each_recording(options, [&](const Recorded& recorded, const Json& recording) {
    const Mapper mapper = mapped(recorded, parameters_at(options.resolutions.front(), options.set));
    const Eigen::Vector3d up = up_of(mapper.map()).direction;
    const evaluation::StairScores scores =
        evaluation::evaluate_stairs(find_stairs(*mapper.snapshot(), up).stairs, recorded.truth, up);
    for (const evaluation::StairScore& stair : scores.stairs) {
      Json row{{"seen", stair.wholly_seen()},
               {"steps", stair.steps},
               {"found", stair.found},
               {"pieces", stair.pieces},
               {"right_count", stair.wholly_seen() && stair.right_count()}};
      if (row["right_count"])
        row.update(Json{{"right_course", stair.right_kind},
                        {"riser_mm", 1e3 * std::fabs(stair.riser_m)},
                        {"tread_mm", 1e3 * std::fabs(stair.tread_m)},
                        {"width_mm", 1e3 * std::fabs(stair.width_m)},
                        {"heading_deg", deg * std::fabs(stair.heading_rad)}});
      write(recording, row);
    }
    write(recording, {{"invented", scores.invented}});
  });
}

}  // namespace octosurf::bench
