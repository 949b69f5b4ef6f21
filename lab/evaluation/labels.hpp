#pragma once

#include "evaluation/evaluate.hpp"
#include "evaluation/hoover.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::evaluation {

/// One scan whose points are labelled by hand or by construction. Points without reading are left
/// out; label 0 is "unlabelled".
struct LabelledCloud {
  enum class Kind {
    planes,  ///< every label is a plane
    support  ///< label 1 is the supporting plane (a table), all others are things that stand on it
  };
  std::string name;
  Kind kind = Kind::planes;
  std::vector<Eigen::Vector3f> points;  ///< map frame (a PCD's VIEWPOINT applied), metres
  std::vector<std::uint32_t> labels;    ///< per point
};

/// Reads, told apart by content,
/// - a PCD file with fields `label` and `rgba` (mOSD): labels 1 … 9 become 1, Kind::support;
/// - a PCD file with a field `label` and no colour (simulate's): Kind::planes;
/// - a PCD file with a field `intensity` that holds plane ids (SynPEB): Kind::planes;
/// - a folder with one `depth*.png` (16 bit, 5000 per metre), one `*labels*.png` (16 bit, same size)
///   and one `*.K` (3×3 intrinsics; fy < 0 if y points up) (EVOPS, ICL-NUIM): Kind::planes.
/// Throws Error(data) for anything else.
LabelledCloud load_labelled_cloud(const std::filesystem::path& path);

struct LabelOptions {
  std::size_t min_points = 300;  ///< smaller labels are not judged, smaller surfaces no noise
  double max_rms = 0.02;         ///< m: labels that are less planar are not judged
  double threshold = 0.8;        ///< Hoover's T, in (0.5, 1]
};

struct LabelScore {
  std::uint32_t label = 0;
  TruthVerdict verdict = TruthVerdict::missed;
  std::size_t points = 0;
  double rms_m = 0;       ///< of the points' distances to their least-squares plane
  double covered = 0;     ///< share of the points that are in any surface
  SurfaceId surface = 0;  ///< the correct one, else the one that holds most of it; 0: none
  double by_surface = 0;  ///< share of the label's points in `surface`
  double of_surface = 0;  ///< share of `surface`'s labelled points with this label
  double iou = 0;         ///< intersection over union of the two point sets
  double normal_rad = 0;  ///< angle between the label's plane and `surface`'s, either side; 0 if none
  double offset_m = 0;    ///< signed distance of the label's centroid to `surface`'s plane
};

/// Segmentation of the labelled points by the surfaces that hold them: hoover.hpp over point sets,
/// with points of label 0 left out altogether.
///
/// A label is judged if it has `min_points` and is planar to `max_rms`; with Kind::support only the
/// support is judged (the things' own faces are not labelled), and `noise` is 0. `coverage` is over
/// judged labels; `mean_iou` averages LabelScore::iou over them; normal and offset over correct
/// ones, against the least-squares plane of the label's points.
struct LabelEvaluation {
  std::size_t labels = 0;  ///< judged
  std::size_t correct = 0, over_segmented = 0, under_segmented = 0, missed = 0;
  std::size_t surfaces = 0;  ///< that hold labelled points
  std::size_t noise = 0;
  std::size_t points = 0;  ///< labelled
  double coverage = 0, mean_iou = 0;
  Summary normal_rad, offset_m;
  std::optional<double> support_iou;     ///< of the support (Kind::support only)
  std::vector<LabelScore> label_scores;  ///< ascending label; not judged ones too
};

/// `points` are the cloud's points in the map's frame, `found` the surface that holds each (0: none;
/// e.g. Map::at(point).surface). Throws Error(usage) for options out of range or sizes that differ,
/// Error(data) if no label can be judged or a surface is not in the snapshot. O(n log n).
LabelEvaluation evaluate_labels(const LabelledCloud& cloud, std::span<const Eigen::Vector3d> points,
                                std::span<const SurfaceId> found, const Snapshot& snapshot,
                                const LabelOptions& options = {});

/// One JSON object: the fields of LabelEvaluation by name, angles in degrees (`normal_deg`),
/// `support_iou` null where there is none; `label_scores` [{label, verdict, points, rms_m, covered,
/// surface, by_surface, of_surface, iou, normal_deg, offset_m}].
std::string to_json(const LabelEvaluation& evaluation);

}  // namespace octosurf::evaluation
