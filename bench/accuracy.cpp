// How exact the surfaces are on simulated scenes: with default parameters, with the paper's detector from
// PCL's parts, and by CGAL's region growing and Efficient RANSAC, all on the same scans and scored alike; and
// what each departure from the paper is worth.

#include "bench/bench.hpp"
#include "detection/likelihood_detector.hpp"
#include "evaluation/evaluate.hpp"
#include "geometry/voxel_grid.hpp"

#include <set>

namespace octosurf::bench {
namespace {

/// One way to get surfaces from scans.
struct Method {
  std::string name;
  Parameters parameters;
  CgalMethod cgal = nullptr;                              ///< in place of a Mapper
  std::shared_ptr<const detection::Detector> detector{};  ///< in place of the paper's
};

std::vector<Method> methods_of(const Options& options) {
  const double d = options.resolutions.front();
  return {{"ours/default", parameters_at(d, options.set)},
          {"ours/paper/r=0.15", paper_parameters(d, 0.15)},
          {"ours/paper/r=0.06", paper_parameters(d, 0.06)},
          {"cgal/growing", parameters_at(d), cgal_region_growing},
          {"cgal/ransac", parameters_at(d), cgal_efficient_ransac}};
}

/// The default, and without one thing that the paper does not do or does otherwise.
std::vector<Method> departures_of(const Options& options) {
  const Parameters ours = parameters_at(options.resolutions.front(), options.set);
  std::vector<Method> methods{{"as it is", ours}};
  methods.push_back(
      {"no see-through", ours, nullptr, std::make_shared<detection::LikelihoodDetector>(false)});
  methods.back().parameters.detection.detector = DetectorKind::paper;  // the one that is handed over
  const auto set = [&](const std::string& name, const std::vector<std::string>& values) {
    std::vector<std::string> all = options.set;
    all.insert(all.end(), values.begin(), values.end());
    methods.push_back({name, parameters_at(options.resolutions.front(), all)});
  };
  const double s = Parameters::paper(ours.occupancy.resolution).surface_tolerance();
  set("s, not measured noise", {"surface_tolerance=" + std::to_string(s)});
  set("no alignment", {"align=off"});
  // Cells are at most h / 4 wide (surfaces/cells.hpp).
  if (ours.occupancy.resolution < 0.02)
    set("no coarse cells", {"max_hole_size=" + std::to_string(0.99 * ours.max_hole_size())});
  return methods;
}

/// Snapshot, and its time: CGAL's is that of normals and planes of all scans' voxels together.
std::pair<Snapshot, double> run_method(const Method& method, const std::vector<Scan>& scans, int threads) {
  if (method.cgal != nullptr) return cgal_surfaces(method.cgal, scans, method.parameters);
  Mapper mapper(method.parameters, threads, method.detector ? method.detector.get() : paper_detector());
  const double ms = time_ms([&] {
    for (const Scan& scan : scans) mapper.insert(scan);
    mapper.drain();
  });
  return {*mapper.snapshot(), ms};
}

/// The voxels, each once, in which a face has readings.
using VoxelsByFace = std::map<std::uint32_t, std::vector<Eigen::Vector3d>>;

VoxelsByFace voxels_by_face(const Recorded& recorded, double resolution) {
  const geometry::VoxelGrid grid(resolution);
  std::set<std::pair<std::uint32_t, std::uint64_t>> known;
  VoxelsByFace voxels;
  for (std::size_t k = 0; k < recorded.scans.size(); ++k)
    for (std::size_t i = 0; i < recorded.labels[k].size(); ++i) {
      geometry::VoxelKey key;
      const Eigen::Vector3d p = recorded.scans[k].T_map_sensor * recorded.scans[k].points[i].cast<double>();
      if (p.allFinite() && grid.key_of(p.cast<float>(), key) &&
          known.emplace(recorded.labels[k][i], key.packed()).second)
        voxels[recorded.labels[k][i]].push_back(p);
    }
  return voxels;
}

/// Whether a face was seen well enough to be one. Its readings are in at least n voxels, as many as a surface
/// must have, and most of them hang together, by gaps of at most h, in a piece as wide as the smallest edge
/// that a foot needs. A line of one ring is not seen well, nor are strips farther apart than h.
bool seen_well(const evaluation::TrueFace& face, const VoxelsByFace& voxels, const Parameters& parameters) {
  constexpr double least_width = 0.08, most = 0.8;  // m; the share: Hoover's
  const double d = parameters.occupancy.resolution;
  const int reach = static_cast<int>(parameters.max_hole_size() / d);
  std::set<std::pair<int, int>> left;
  std::size_t all = 0;
  std::vector<std::uint32_t> parts{face.joined};
  parts.push_back(face.id);
  for (const std::uint32_t part : parts) {
    const auto its = voxels.find(part);
    if (its == voxels.end()) continue;
    all += its->second.size();
    for (const Eigen::Vector3d& p : its->second) {
      const Eigen::Vector3d at = face.T_map_face.inverse() * p;
      left.emplace(static_cast<int>(std::floor(at.y() / d)), static_cast<int>(std::floor(at.x() / d)));
    }
  }
  if (all < static_cast<std::size_t>(parameters.min_surface_points())) return false;
  const double needed = most * static_cast<double>(left.size());
  while (static_cast<double>(left.size()) >= needed) {
    std::vector<std::pair<int, int>> group{*left.begin()};
    left.erase(left.begin());
    for (std::size_t k = 0; k < group.size(); ++k)
      for (int row = -reach; row <= reach; ++row) {
        const int across = static_cast<int>(std::sqrt(reach * reach - row * row));
        auto at = left.lower_bound({group[k].first + row, group[k].second - across});
        while (at != left.end() && at->first == group[k].first + row &&
               at->second <= group[k].second + across) {
          group.push_back(*at);
          at = left.erase(at);
        }
      }
    if (static_cast<double>(group.size()) < needed) continue;
    Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(group.size()));
    for (std::size_t k = 0; k < group.size(); ++k)
      places.col(static_cast<Eigen::Index>(k)) = d * Eigen::Vector2d(group[k].second, group[k].first);
    places.colwise() -= Eigen::Vector2d(places.rowwise().mean());
    const Eigen::Matrix2d spread = places * places.transpose() / static_cast<double>(group.size());
    const double narrow = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvalues()[0];
    return std::sqrt(12 * narrow) >= least_width;  // of a rectangle
  }
  return false;
}

void score(std::vector<Method> methods, const Options& options) {
  std::erase_if(methods, [&](const Method& method) { return !wanted(options, method.name); });
  if (methods.empty()) throw Error(Error::Kind::usage, "--only", "leaves no method", "try ours or cgal");
  for_each_recording(options, [&](const Recorded& recorded, const Json& recording) {
    const VoxelsByFace voxels = voxels_by_face(recorded, options.resolutions.front());
    for (const Method& method : methods) {
      const auto [snapshot, ms] = run_method(method, recorded.scans, options.threads);
      const evaluation::Evaluation evaluation = evaluation::evaluate(snapshot, recorded.truth);
      const evaluation::Truth truth =
          evaluation::join_faces(recorded.truth, evaluation.options.one_plane_at(evaluation.resolution_m));
      Json row = Json::parse(to_json(evaluation));
      row.update(named("method scans ms wrong", method.name, recorded.scans.size(), ms, Json::array()));
      std::size_t well = 0, well_correct = 0;
      for (std::size_t k = 0; k < evaluation.face_scores.size(); ++k) {
        const evaluation::FaceScore& face = evaluation.face_scores[k];
        if (face.verdict == evaluation::TruthVerdict::not_judged) continue;
        const bool correct = face.verdict == evaluation::TruthVerdict::correct;
        const auto its = std::ranges::find(truth.faces, face.id, &evaluation::TrueFace::id);
        const bool is_seen_well = seen_well(*its, voxels, method.parameters);
        well += is_seen_well;
        well_correct += is_seen_well && correct;
        if (!correct) row["wrong"].push_back(row["face_scores"][k]);
      }
      row["seen_well"] = well;
      row["seen_well_correct"] = well_correct;
      for (const char* list : {"face_scores", "surface_scores", "hole_scores"}) row.erase(list);
      write(recording, row);
    }
  });
}

}  // namespace

void accuracy(const Options& options) { score(methods_of(options), options); }
void departures(const Options& options) { score(departures_of(options), options); }

}  // namespace octosurf::bench
