#include "evaluation/evaluate.hpp"

#include "evaluation/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::evaluation {
namespace {

constexpr std::size_t margins = outline_margins.size();

struct SurfaceSamples {
  std::size_t all = 0, unsafe = 0, ghost = 0;
  std::array<std::size_t, margins> rim{};
  std::size_t wrong = 0;  // definition 10's false
};

struct CellCounts {
  std::size_t covered = 0;           // by any surface
  std::size_t layers = 0;            // summed over the covering surfaces
  std::size_t covered_by_parts = 0;  // by surfaces that lie on the face
};

/// A patch met by the samples of another: motion between their frames, and what to do on contact.
struct Meeting {
  Pair* pair;
  const Patch* patch;
  Eigen::Isometry3d T_patch_sampled;
  bool flag;
};

bool meets(const Meeting& meeting, const Eigen::Vector2d& uv, double tolerance, double margin) {
  const Eigen::Vector3d p = transfer(meeting.T_patch_sampled, uv);
  return std::abs(p.z()) <= tolerance && meeting.patch->region.within(p.head<2>(), margin);
}

/// Definition 10's outline distance; infinite beyond the rim.
double outline_distance(const Meeting& meeting, const Eigen::Vector2d& uv, double tolerance) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d p = transfer(meeting.T_patch_sampled, uv);
  if (std::abs(p.z()) > tolerance) return infinity;
  const PlanarRegion& region = meeting.patch->region;
  return region.contains(p.head<2>()) ? 0 : region.ring_distance(p.head<2>(), rim_width);
}

void count_outline(const std::vector<Meeting>& meetings, const Eigen::Vector2d& uv, double tolerance,
                   SurfaceSamples& samples) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Meeting& meeting : meetings) {
    if (meeting.flag) continue;  // gone
    nearest = std::min(nearest, outline_distance(meeting, uv, tolerance));
    if (nearest == 0) return;
  }
  if (nearest > rim_width) {
    ++samples.wrong;
    return;
  }
  for (std::size_t m = 0; m < margins; ++m) samples.rim[m] += nearest > outline_margins[m];
}

// Definitions 3, 6 and 10; counts Pair::lying.
SurfaceSamples sample_surface(Scene& scene, std::size_t index) {
  const Patch& surface = scene.surfaces[index];
  std::vector<Meeting> meetings;
  for (const std::size_t i : scene.pairs_of_surface[index]) {
    const std::size_t f = scene.pairs[i].face;
    const Patch& face = scene.faces[f];
    const Eigen::Isometry3d T_face_surface = face.T_map_patch.inverse() * surface.T_map_patch;
    meetings.push_back({&scene.pairs[i], &face, T_face_surface, scene.truth->faces[f].gone});
  }
  SurfaceSamples samples;
  surface.region.for_each_cell(scene.options.grid, [&](const Eigen::Vector2d& uv) {
    bool safe = false;
    bool ghost = false;
    for (const Meeting& meeting : meetings) {
      if (!meets(meeting, uv, scene.tolerance, scene.snapshot->resolution)) continue;
      (meeting.flag ? ghost : safe) = true;
      if (meeting.pair->aligned) ++meeting.pair->lying;
    }
    ++samples.all;
    samples.unsafe += !safe;
    samples.ghost += !safe && ghost;
    count_outline(meetings, uv, scene.tolerance, samples);
  });
  return samples;
}

// Definition 2; counts Pair::covered. Needs Pair::lying.
CellCounts cover_face(Scene& scene, std::size_t index, const std::vector<SurfaceSamples>& samples) {
  const Patch& face = scene.faces[index];
  std::vector<Meeting> meetings;
  for (const std::size_t i : scene.pairs_of_face[index]) {
    Pair& pair = scene.pairs[i];
    if (!pair.aligned) continue;
    const Patch& surface = scene.surfaces[pair.surface];
    const Eigen::Isometry3d T_surface_face = surface.T_map_patch.inverse() * face.T_map_patch;
    const bool part = share(pair.lying, samples[pair.surface].all) >= scene.options.threshold;
    meetings.push_back({&pair, &surface, T_surface_face, part});
  }
  CellCounts cells;
  scene.visible[index].for_each_centre([&](const Eigen::Vector2d& uv) {
    std::size_t layers = 0;
    bool by_parts = false;
    for (const Meeting& meeting : meetings) {
      if (!meets(meeting, uv, scene.tolerance, scene.snapshot->resolution / 2)) continue;
      ++meeting.pair->covered;
      ++layers;
      by_parts = by_parts || meeting.flag;
    }
    cells.layers += layers;
    cells.covered += layers > 0;
    cells.covered_by_parts += by_parts;
  });
  return cells;
}

/// All that was counted, and Hoover's verdicts from it.
struct Counts {
  std::vector<SurfaceSamples> samples;  // per surface
  std::vector<CellCounts> cells;        // per face; zeros for gone ones
  std::vector<bool> judged;             // per face
  HooverResult hoover;
};

HooverResult judge(const Scene& scene, const Counts& counts) {
  HooverRegions regions;
  regions.truth_judged = counts.judged;
  const double cell_m2 = scene.options.grid * scene.options.grid;
  for (const SurfaceSamples& samples : counts.samples) {
    regions.found_judged.push_back(static_cast<double>(samples.all) * cell_m2 >= scene.options.min_area);
  }
  for (std::size_t f = 0; f < counts.cells.size(); ++f) {
    regions.covered_by_parts.push_back(share(counts.cells[f].covered_by_parts, scene.visible[f].count()));
  }
  std::vector<Overlap> overlaps;
  for (const Pair& pair : scene.pairs) {
    if (!pair.aligned || scene.truth->faces[pair.face].gone) continue;
    overlaps.push_back({pair.face, pair.surface, share(pair.covered, scene.visible[pair.face].count()),
                        share(pair.lying, counts.samples[pair.surface].all)});
  }
  return hoover(regions, overlaps, scene.options.threshold);
}

Counts count(Scene& scene) {
  Counts counts;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) counts.samples.push_back(sample_surface(scene, s));
  for (std::size_t f = 0; f < scene.faces.size(); ++f) {
    const bool present = !scene.truth->faces[f].gone;
    // Half a cell of slack: an area that equals min_area must not fail by rounding.
    const double half_cell_m2 = scene.truth->cell * scene.truth->cell / 2;
    const TrueFace& face = scene.truth->faces[f];
    const double seen_m2 = face.joined.empty() ? scene.visible_m2(f) : face.largest_part_m2;
    counts.judged.push_back(present && seen_m2 + half_cell_m2 > scene.options.min_area &&
                            scene.visible[f].count() > 0);
    counts.cells.push_back(present ? cover_face(scene, f, counts.samples) : CellCounts{});
  }
  if (std::find(counts.judged.begin(), counts.judged.end(), true) == counts.judged.end()) {
    throw Error(Error::Kind::usage, "min-area",
                "no face was seen with " + std::to_string(scene.options.min_area) + " m² or more",
                "lower it");
  }
  counts.hoover = judge(scene, counts);
  return counts;
}

const Pair* pair_of(const Scene& scene, const Counts& counts, std::size_t f) {
  const Pair* best = nullptr;
  for (const std::size_t i : scene.pairs_of_face[f]) {
    const Pair& pair = scene.pairs[i];
    if (counts.hoover.match[f] == pair.surface) return &pair;
    if (pair.covered > (best ? best->covered : 0)) best = &pair;
  }
  return best;
}

Eigen::Vector3d visible_centroid(const Scene& scene, std::size_t f) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  scene.visible[f].for_each_centre([&sum](const Eigen::Vector2d& uv) { sum += uv; });
  return transfer(scene.faces[f].T_map_patch, sum / static_cast<double>(scene.visible[f].count()));
}

/// The judged faces of which a surface that covers this one covers as large a share, by id.
std::vector<FusedWith> fused_with(const Scene& scene, const Counts& counts, std::size_t f) {
  const auto covers = [&](const Pair& pair) {
    return pair.aligned && counts.judged[pair.face] &&
           share(pair.covered, scene.visible[pair.face].count()) >= scene.options.threshold;
  };
  std::set<std::size_t> others;
  for (const std::size_t i : scene.pairs_of_face[f]) {
    if (!covers(scene.pairs[i])) continue;
    for (const std::size_t k : scene.pairs_of_surface[scene.pairs[i].surface])
      if (covers(scene.pairs[k]) && scene.pairs[k].face != f) others.insert(scene.pairs[k].face);
  }
  std::vector<FusedWith> fused;
  for (const std::size_t g : others) {
    const TrueFace& other = scene.truth->faces[g];
    fused.push_back({other.id, other.name, fold_between(scene.truth->faces[f], other)});
  }
  return fused;
}

FaceScore score_face(const Scene& scene, const Counts& counts, std::size_t f) {
  const TrueFace& face = scene.truth->faces[f];
  const CellCounts& cells = counts.cells[f];
  FaceScore score;
  score.id = face.id;
  score.name = face.name;
  score.verdict = counts.hoover.truth[f];
  score.visible_m2 = scene.visible_m2(f);
  score.joined = face.joined;
  if (score.verdict == TruthVerdict::under_segmented) score.fused_with = fused_with(scene, counts, f);
  score.covered = share(cells.covered, scene.visible[f].count());
  score.multiplicity = share(cells.layers, cells.covered);
  if (const Pair* pair = pair_of(scene, counts, f)) {
    const Plane& plane = scene.surfaces[pair->surface].plane;
    score.surface = scene.snapshot->surfaces[pair->surface]->id;
    score.by_surface = share(pair->covered, scene.visible[f].count());
    score.of_surface = share(pair->lying, counts.samples[pair->surface].all);
    score.normal_rad = angle_between(plane.normal, face.plane.normal);
    score.offset_m = plane.signed_distance(visible_centroid(scene, f));
  }
  return score;
}

/// The surfaces that lie on a face with so much of their area that they are it, or parts of it.
std::vector<std::size_t> lying_on(const Scene& scene, const Counts& counts, std::size_t f) {
  std::vector<std::size_t> surfaces;
  for (const std::size_t i : scene.pairs_of_face[f]) {
    const Pair& pair = scene.pairs[i];
    if (pair.aligned && share(pair.lying, counts.samples[pair.surface].all) >= scene.options.threshold)
      surfaces.push_back(pair.surface);
  }
  return surfaces;
}

void add_faces(const Scene& scene, const Counts& counts, Evaluation& result) {
  std::vector<double> normals, offsets, boundaries, all_normals, all_offsets;
  std::size_t seen = 0, covered = 0, layers = 0, seen_all = 0, covered_all = 0;
  for (std::size_t f = 0; f < scene.faces.size(); ++f) {
    if (scene.truth->faces[f].gone || scene.visible[f].count() == 0) continue;
    const FaceScore& score = result.face_scores.emplace_back(score_face(scene, counts, f));
    seen_all += scene.visible[f].count();
    covered_all += counts.cells[f].covered;
    result.correct += score.verdict == TruthVerdict::correct;
    result.over_segmented += score.verdict == TruthVerdict::over_segmented;
    result.under_segmented += score.verdict == TruthVerdict::under_segmented;
    result.missed += score.verdict == TruthVerdict::missed;
    if (counts.judged[f]) {
      ++result.faces;
      result.visible_m2 += score.visible_m2;
      seen += scene.visible[f].count();
      covered += counts.cells[f].covered;
      layers += counts.cells[f].layers;
      if (score.surface != 0) {
        all_normals.push_back(score.normal_rad);
        all_offsets.push_back(std::abs(score.offset_m));
      }
    }
    if (counts.hoover.match[f]) {
      normals.push_back(score.normal_rad);
      offsets.push_back(std::abs(score.offset_m));
      append_boundary_distances(scene, f, lying_on(scene, counts, f), boundaries);
    }
    if (score.by_surface >= scene.options.threshold) {
      const std::vector<HoleScore> holes = score_holes(scene, f, pair_of(scene, counts, f)->surface);
      result.hole_scores.insert(result.hole_scores.end(), holes.begin(), holes.end());
    }
  }
  result.coverage = share(covered, seen);
  result.coverage_all = share(covered_all, seen_all);
  result.multiplicity = share(layers, covered);
  result.normal_rad = summarize(std::move(normals));
  result.offset_m = summarize(std::move(offsets));
  result.boundary_m = summarize(std::move(boundaries));
  result.normal_all_rad = summarize(std::move(all_normals));
  result.offset_all_m = summarize(std::move(all_offsets));
  result.holes = result.hole_scores.size();
  for (const HoleScore& hole : result.hole_scores) result.holes_found += hole.found;
}

void add_surfaces(const Scene& scene, const Counts& counts, Evaluation& result) {
  const double cell_m2 = scene.options.grid * scene.options.grid;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const SurfaceSamples& samples = counts.samples[s];
    SurfaceScore score;
    score.id = scene.snapshot->surfaces[s]->id;
    score.verdict = counts.hoover.found[s];
    score.area_m2 = static_cast<double>(samples.all) * cell_m2;
    score.unsafe_m2 = static_cast<double>(samples.unsafe) * cell_m2;
    score.ghost_m2 = static_cast<double>(samples.ghost) * cell_m2;
    for (std::size_t m = 0; m < margins; ++m) {
      score.rim_m2[m] = static_cast<double>(samples.rim[m]) * cell_m2;
      result.rim_m2[m] += score.rim_m2[m];
    }
    score.false_m2 = static_cast<double>(samples.wrong) * cell_m2;
    result.false_m2 += score.false_m2;
    std::size_t lying = 0;
    for (const std::size_t i : scene.pairs_of_surface[s]) {
      const Pair& pair = scene.pairs[i];
      if (scene.truth->faces[pair.face].gone || pair.lying <= lying) continue;
      lying = pair.lying;
      score.face = scene.truth->faces[pair.face].id;
    }
    score.on_face = share(lying, samples.all);
    const bool noise = score.verdict == FoundVerdict::noise;
    result.noise += noise;
    result.repeated += noise && score.on_face >= scene.options.threshold;
    result.area_m2 += score.area_m2;
    result.unsafe_m2 += score.unsafe_m2;
    result.ghost_m2 += score.ghost_m2;
    result.surface_scores.push_back(score);
  }
  result.surfaces = scene.surfaces.size();
  result.unsafe_share = result.area_m2 > 0 ? result.unsafe_m2 / result.area_m2 : 0;
}

}  // namespace

double EvaluationOptions::tolerance_at(double resolution) const {
  return tolerance.value_or(std::max(0.02, 1.5 * resolution));
}

OnePlane EvaluationOptions::one_plane_at(double resolution) const {
  return {joined_rad, joined_voxels * resolution, joined_gap.value_or(std::max(0.08, 4 * resolution))};
}

Summary summarize(std::vector<double> values) {
  Summary summary;
  summary.count = values.size();
  if (values.empty()) return summary;
  std::sort(values.begin(), values.end());
  for (const double value : values) summary.mean += value;
  summary.mean /= static_cast<double>(values.size());
  const double rank = std::ceil(0.95 * static_cast<double>(values.size()));
  summary.p95 = values[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
  summary.max = values.back();
  return summary;
}

Evaluation evaluate(const Snapshot& snapshot, const Truth& truth, const EvaluationOptions& options) {
  Scene scene = prepare(snapshot, truth, options);  // checks the truth, too
  const Truth joined = join_faces(truth, options.one_plane_at(snapshot.resolution));
  scene = prepare(snapshot, joined, options);
  const Counts counts = count(scene);
  Evaluation result;
  result.options = scene.options;
  result.resolution_m = snapshot.resolution;
  add_faces(scene, counts, result);
  add_surfaces(scene, counts, result);
  return result;
}

}  // namespace octosurf::evaluation
