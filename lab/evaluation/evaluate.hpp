#pragma once

#include "evaluation/hoover.hpp"
#include "evaluation/one_plane.hpp"
#include "evaluation/truth.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::evaluation {

struct EvaluationOptions {
  double min_area = 0.05;                    ///< m²: faces of which less was seen are not judged, nor are
                                             ///< smaller surfaces called noise
  std::optional<double> tolerance;           ///< m: along the normal; empty: max(0.02, 1.5·resolution)
  double angle_rad = 0.2617993877991494;     ///< a surface covers, or lies on, a face up to here (15°)
  double support_rad = 0.5235987755982988;   ///< a face supports a surface up to here (30°)
  double threshold = 0.8;                    ///< Hoover's T, in (0.5, 1]
  double grid = 0.01;                        ///< m: sampling of surfaces, rings and holes
  double joined_rad = 0.008726646259971648;  ///< faces turned by no more are one plane (0.5°)
  double joined_voxels = 0.25;               ///< and off each other's plane by no more, in units of d
  std::optional<double> joined_gap;          ///< m: and nearer; empty: the map's default h, max(0.08, 4 d)

  double tolerance_at(double resolution) const;
  OnePlane one_plane_at(double resolution) const;
};

struct Summary {
  std::size_t count = 0;
  double mean = 0, p95 = 0, max = 0;  ///< 0 if count is 0
};
/// p95 is the smallest value that at least 95 % of the values do not exceed.
Summary summarize(std::vector<double> values);

/// Another face that the surface of an under-segmented one covers, too.
struct FusedWith {
  std::uint32_t id = 0;
  std::string name;
  Fold fold;  ///< what should have kept the two apart
};

struct FaceScore {
  std::uint32_t id = 0;
  std::string name;
  TruthVerdict verdict = TruthVerdict::missed;
  double visible_m2 = 0;              ///< visible cells · cell², at most its own area
  double covered = 0;                 ///< share of the visible area that any surface covers
  double multiplicity = 0;            ///< mean number of surfaces over the covered part; 0 if none
  SurfaceId surface = 0;              ///< the correct one, else the one that covers most of it; 0: none
  double by_surface = 0;              ///< share of the visible area that `surface` covers
  double of_surface = 0;              ///< share of `surface`'s area that lies on this face
  double normal_rad = 0;              ///< angle between the normals of `surface` and face; 0 if none
  double offset_m = 0;                ///< signed distance of the visible cells' centroid to `surface`
  std::vector<std::uint32_t> joined;  ///< ids of the faces that are one with it (definition 0)
  std::vector<FusedWith> fused_with;  ///< of an under-segmented face, by id
};

/// m off the true outline beyond which a foot's support is judged, finest first (definition 10).
inline constexpr std::array outline_margins{0.01, 0.015};
/// m: as far off an outline as a surface's rim may be; what lies farther is false (definition 10).
inline constexpr double rim_width = 0.05;

struct SurfaceScore {
  SurfaceId id = 0;
  FoundVerdict verdict = FoundVerdict::noise;
  double area_m2 = 0, unsafe_m2 = 0, ghost_m2 = 0;
  std::array<double, outline_margins.size()> rim_m2{};  ///< one for each margin
  double false_m2 = 0;
  std::uint32_t face = 0;  ///< present face on which most of it lies; 0: none
  double on_face = 0;      ///< share of its area that lies there
};

struct HoleScore {
  std::uint32_t face = 0;
  double area_m2 = 0;
  double empty = 0;    ///< share of its area outside the covering surface's polygons
  bool found = false;  ///< empty ≥ threshold
};

/// How well surfaces agree with the truth of a simulated recording. Definitions (p a point, S a
/// surface, F a true face, tol the tolerance, d the snapshot's resolution):
///
/// 0. A true face is what a foot finds: present faces in one plane, by `joined_rad` and `joined_voxels`, that
/// lie
///    nearer to each other than `joined_gap` are one (join_faces()). Blocks set side by side are one face; a
///    map joins them across gaps up to h, as it should. Where parts of a joined face meet is no outline (8).
///    What was seen of a face in pieces farther than that from each other, such as a wall beside a door of
///    which nobody saw the lintel, is as many faces of its id.
/// 1. A true face is *present* unless `gone`, and *judged* if it is present and its visible cells
///    amount to `min_area`; of a joined face those of its largest part, as slivers side by side are no larger
///    face. Its sample points are the centres of its visible cells.
/// 2. S *covers* a sample point p of F if the angle between the (directed) normals is at most
///    `angle_rad`, p is at most tol off S's plane, and p's projection onto it lies inside S's
///    polygons or at most d/2 from their rings.
/// 3. S is sampled on a grid of `grid`; its area is the number of samples · grid². A sample p *lies
///    on* F if the angle is at most `angle_rad`, p is at most tol off F's plane, and its projection
///    lies inside F's polygons (seen or not) or at most d from their rings. F *supports* p if the
///    same holds with `support_rad`.
/// 4. Correct, over-segmented, under-segmented, missed, noise: hoover.hpp, with the visible area
///    covered by S as the face's share and S's area on F as the surface's share.
///    `repeated` of the `noise` lies with `threshold` or more on one present face: double layers
///    and fragments.
/// 5. `coverage`: share of the judged faces' visible area that some S covers; `coverage_all` of all
///    present faces'. `multiplicity`: mean number of surfaces covering, over the covered part of
///    the judged faces' visible area; 0 if nothing is covered.
/// 6. `unsafe_m2`: area of samples that no present face supports. Curved things are not in the
///    truth, so area on them is unsafe. `ghost_m2`, part of it: those a `gone` face supports.
/// 7. `normal_rad`, `offset_m` (absolute), over correct faces: the angle between the normals, and
///    the distance of the visible cells' centroid to S's plane (there, not at the origin, where a
///    far-off scene turns a small angle into a large offset).
/// 8. `boundary_m`, over correct faces, counts edges that some scan saw, in both directions, with the
///    surfaces of which `threshold` or more lies on F: where F was seen in patches, each has its own. From
///    points every `grid` along F's rings that have a visible cell within r = max(2 cells, d), to the nearest
///    ring of these surfaces, in its plane; and from points every `grid` along their rings, to the nearest
///    ring of F, where 2 r away F was seen and none of these surfaces comes within r: there the map has an
///    edge and F has none. A surface that ends where F was no longer seen has no edge to be judged there, nor
///    has a hole of F that holds no circle as wide as `joined_gap`, which a map fills on purpose.
/// 9. A true hole is asked for if its area (without islands) is at least 0.02 m², the largest
///    inscribed circle is wider than 0.1 m, half of its ring or more has visible cells next to it
///    (as in 8), and one surface covers `threshold` of the face or more. It is found if at least
///    `threshold` of its area is outside that surface's polygons.
/// 10. As 6, but for the true outline instead of one a voxel wider. F's *outline distance* to a sample p
///    that is at most tol off F's plane, with normals at most `support_rad` apart, is 0 if p's
///    projection lies inside F's polygons, else its distance to their rings; the least over the present
///    faces counts. p is *off* at a margin if it is greater than that, *false* if it is greater than
///    `rim_width` or there is no such face. `unsafe_at` is the area off at each of `outline_margins`:
///    its `rim` (not false) and `false_m2`, which is the same at every margin. A face's polygons are all
///    of it that nothing stands on, seen or not: a foot can stand on what was hidden from the sensor, so
///    a surface that reaches there is right. Area on curved things is false, as in 6.
/// 11. `normal_all_rad`, `offset_all_m`: as 7, over every judged face that some surface covers, whatever
///    its verdict, by the surface that covers most of it (the correct one if there is one).
struct Evaluation {
  EvaluationOptions options;  ///< as in force: the tolerance is filled in
  double resolution_m = 0;
  std::size_t faces = 0;  ///< judged = correct + over + under + missed
  std::size_t correct = 0, over_segmented = 0, under_segmented = 0, missed = 0;
  std::size_t surfaces = 0, noise = 0, repeated = 0;
  double visible_m2 = 0;  ///< of judged faces
  double coverage = 0, coverage_all = 0, multiplicity = 0;
  double area_m2 = 0;                                    ///< of all surfaces
  double unsafe_m2 = 0, unsafe_share = 0, ghost_m2 = 0;  ///< share of area_m2; 0 without surfaces
  std::array<double, outline_margins.size()> rim_m2{};   ///< off the true outline by more than each
  double false_m2 = 0;                                   ///< more than rim_width off every true face
  Summary normal_rad, offset_m, boundary_m;
  Summary normal_all_rad, offset_all_m;
  std::size_t holes = 0, holes_found = 0;
  std::vector<FaceScore> face_scores;        ///< every present face with visible cells, truth's order
  std::vector<SurfaceScore> surface_scores;  ///< every surface, snapshot's order
  std::vector<HoleScore> hole_scores;

  double unsafe_at(std::size_t margin) const { return rim_m2.at(margin) + false_m2; }  ///< m²
};

/// Throws Error(usage) for a `min_area` that no face reaches, Error(data)
/// for a truth without visible faces, for planes and frames that disagree, and for coordinates
/// that are not finite or enclose more than 10⁵ m². Deterministic, single-threaded; about a second
/// for 100 m² at the defaults.
Evaluation evaluate(const Snapshot& snapshot, const Truth& truth, const EvaluationOptions& options = {});

/// One JSON object: the fields of Evaluation by name, angles in degrees (`normal_deg`, …), summaries
/// as {count, mean, p95, max}; of definition 10 `unsafe_10mm_m2`, `unsafe_10mm_share`, `rim_10mm_m2`, the
/// same of 15mm, `false_m2` and `false_share` (of area_m2); `options` {min_area_m2, tolerance_m, angle_deg,
/// support_deg, threshold, grid_m, joined_deg, joined_voxels, joined_gap_m}; `face_scores` [{id, name,
/// verdict, visible_m2, covered, multiplicity, surface, by_surface, of_surface, normal_deg, offset_m, joined:
/// [ids], fused_with: [{face, name, angle_deg, offset_m}]}], `surface_scores` [{id, verdict, area_m2,
/// unsafe_m2, ghost_m2, rim_10mm_m2, rim_15mm_m2, false_m2, face, on_face}], `hole_scores` [{face, area_m2,
/// empty, found}].
std::string to_json(const Evaluation& evaluation);

}  // namespace octosurf::evaluation
