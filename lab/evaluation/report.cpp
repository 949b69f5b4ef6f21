#include "evaluation/evaluate.hpp"
#include "evaluation/labels.hpp"

#include <nlohmann/json.hpp>
#include <numbers>

namespace octosurf::evaluation {
namespace {

using OrderedJson = nlohmann::ordered_json;

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

OrderedJson to_object(const Summary& summary, double scale = 1) {
  return {{"count", summary.count},
          {"mean", summary.mean * scale},
          {"p95", summary.p95 * scale},
          {"max", summary.max * scale}};
}

OrderedJson to_object(const FaceScore& score) {
  OrderedJson fused = OrderedJson::array();
  for (const FusedWith& other : score.fused_with)
    fused.push_back({{"face", other.id},
                     {"name", other.name},
                     {"angle_deg", degrees(other.fold.angle_rad)},
                     {"offset_m", other.fold.offset_m}});
  return {{"id", score.id},
          {"name", score.name},
          {"verdict", name_of(score.verdict)},
          {"visible_m2", score.visible_m2},
          {"covered", score.covered},
          {"multiplicity", score.multiplicity},
          {"surface", score.surface},
          {"by_surface", score.by_surface},
          {"of_surface", score.of_surface},
          {"normal_deg", degrees(score.normal_rad)},
          {"offset_m", score.offset_m},
          {"joined", score.joined},
          {"fused_with", fused}};
}

OrderedJson to_object(const SurfaceScore& score) {
  return {{"id", score.id},
          {"verdict", name_of(score.verdict)},
          {"area_m2", score.area_m2},
          {"unsafe_m2", score.unsafe_m2},
          {"ghost_m2", score.ghost_m2},
          {"rim_10mm_m2", score.rim_m2[0]},
          {"rim_15mm_m2", score.rim_m2[1]},
          {"false_m2", score.false_m2},
          {"face", score.face},
          {"on_face", score.on_face}};
}

OrderedJson to_object(const HoleScore& score) {
  return {{"face", score.face}, {"area_m2", score.area_m2}, {"empty", score.empty}, {"found", score.found}};
}

OrderedJson to_object(const LabelScore& score) {
  return {{"label", score.label},
          {"verdict", name_of(score.verdict)},
          {"points", score.points},
          {"rms_m", score.rms_m},
          {"covered", score.covered},
          {"surface", score.surface},
          {"by_surface", score.by_surface},
          {"of_surface", score.of_surface},
          {"iou", score.iou},
          {"normal_deg", degrees(score.normal_rad)},
          {"offset_m", score.offset_m}};
}

template <class Score>
OrderedJson to_array(const std::vector<Score>& scores) {
  OrderedJson array = OrderedJson::array();
  for (const Score& score : scores) array.push_back(to_object(score));
  return array;
}

// Names come from files: bytes that are not UTF-8 must not stop the report.
std::string dump(const OrderedJson& json) {
  return json.dump(1, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace

std::string to_json(const Evaluation& evaluation) {
  static_assert(outline_margins == std::array{0.01, 0.015}, "the names below say the margins");
  const EvaluationOptions& options = evaluation.options;
  const auto share = [&evaluation](double area_m2) {
    return evaluation.area_m2 > 0 ? area_m2 / evaluation.area_m2 : 0;
  };
  const OrderedJson json{
      {"options",
       {{"min_area_m2", options.min_area},
        {"tolerance_m", options.tolerance_at(evaluation.resolution_m)},
        {"angle_deg", degrees(options.angle_rad)},
        {"support_deg", degrees(options.support_rad)},
        {"threshold", options.threshold},
        {"grid_m", options.grid},
        {"joined_deg", degrees(options.joined_rad)},
        {"joined_voxels", options.joined_voxels},
        {"joined_gap_m", options.one_plane_at(evaluation.resolution_m).gap_m}}},
      {"resolution_m", evaluation.resolution_m},
      {"faces", evaluation.faces},
      {"correct", evaluation.correct},
      {"over_segmented", evaluation.over_segmented},
      {"under_segmented", evaluation.under_segmented},
      {"missed", evaluation.missed},
      {"surfaces", evaluation.surfaces},
      {"noise", evaluation.noise},
      {"repeated", evaluation.repeated},
      {"visible_m2", evaluation.visible_m2},
      {"coverage", evaluation.coverage},
      {"coverage_all", evaluation.coverage_all},
      {"multiplicity", evaluation.multiplicity},
      {"area_m2", evaluation.area_m2},
      {"unsafe_m2", evaluation.unsafe_m2},
      {"unsafe_share", evaluation.unsafe_share},
      {"ghost_m2", evaluation.ghost_m2},
      {"unsafe_10mm_m2", evaluation.unsafe_at(0)},
      {"unsafe_10mm_share", share(evaluation.unsafe_at(0))},
      {"rim_10mm_m2", evaluation.rim_m2[0]},
      {"unsafe_15mm_m2", evaluation.unsafe_at(1)},
      {"unsafe_15mm_share", share(evaluation.unsafe_at(1))},
      {"rim_15mm_m2", evaluation.rim_m2[1]},
      {"false_m2", evaluation.false_m2},
      {"false_share", share(evaluation.false_m2)},
      {"normal_deg", to_object(evaluation.normal_rad, degrees(1))},
      {"offset_m", to_object(evaluation.offset_m)},
      {"boundary_m", to_object(evaluation.boundary_m)},
      {"normal_all_deg", to_object(evaluation.normal_all_rad, degrees(1))},
      {"offset_all_m", to_object(evaluation.offset_all_m)},
      {"holes", evaluation.holes},
      {"holes_found", evaluation.holes_found},
      {"face_scores", to_array(evaluation.face_scores)},
      {"surface_scores", to_array(evaluation.surface_scores)},
      {"hole_scores", to_array(evaluation.hole_scores)},
  };
  return dump(json);
}

std::string to_json(const LabelEvaluation& evaluation) {
  OrderedJson json{
      {"labels", evaluation.labels},
      {"correct", evaluation.correct},
      {"over_segmented", evaluation.over_segmented},
      {"under_segmented", evaluation.under_segmented},
      {"missed", evaluation.missed},
      {"surfaces", evaluation.surfaces},
      {"noise", evaluation.noise},
      {"points", evaluation.points},
      {"coverage", evaluation.coverage},
      {"mean_iou", evaluation.mean_iou},
      {"normal_deg", to_object(evaluation.normal_rad, degrees(1))},
      {"offset_m", to_object(evaluation.offset_m)},
      {"support_iou", evaluation.support_iou ? OrderedJson(*evaluation.support_iou) : OrderedJson()},
      {"label_scores", to_array(evaluation.label_scores)},
  };
  return dump(json);
}

}  // namespace octosurf::evaluation
