#include "io/map_file/record_numbers.hpp"
#include "io/map_file/records.hpp"
#include "map_file.pb.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include <octosurf/scan.hpp>

namespace octosurf::io {
namespace {

using alignment::AlignmentState;

constexpr int most_hypotheses = 1000;
constexpr double largest = 1e9;  // of any number: real poses and evidence stay far below
constexpr NumberRule sensible{largest, "has a number that makes no sense"};
constexpr NumberRule sensible_patch{largest, "has a patch that makes no sense"};
/// The weights of observations add up for as long as a robot runs: by 10⁶ 1/m² with each.
constexpr NumberRule sensible_look{1e30, sensible_patch.otherwise};

void visit(map_file::AlignmentHypothesis& record, AlignmentState::Hypothesis& h, const Damage* damage) {
  visit_numbers(record.mutable_values(), damage, sensible, h.rate_m, h.level, h.log_evidence, h.correction,
                h.errors, h.covariance);
  if (!damage) return;
  damage->require(h.rate_m >= 0, "has a rate that makes no sense");
  require_rigid(h.correction, damage->where);
  const Eigen::SelfAdjointEigenSolver<decltype(h.covariance)> eigen(h.covariance, Eigen::EigenvaluesOnly);
  damage->require(eigen.eigenvalues()[0] >= -1e-9 * (1 + h.covariance.trace()),
                  "has a covariance that is none");
}

using PoseNumbers = google::protobuf::RepeatedField<double>;
void visit(PoseNumbers* numbers, std::optional<Eigen::Isometry3d>& pose, const Damage* damage) {
  if (damage && !numbers->empty()) pose = Eigen::Isometry3d::Identity();
  if (!pose) return;
  visit_numbers(numbers, damage, sensible, *pose);
  if (damage) require_rigid(*pose, damage->where);
}

/// The optional poses and the last failed search.
void visit(map_file::Alignment& record, AlignmentState& state, const Damage* damage) {
  visit(record.mutable_last(), state.last, damage);
  visit(record.mutable_jump(), state.jump, damage);
  if (damage && record.failed_search_size() > 0) state.failed_search.emplace();
  if (state.failed_search)
    visit_numbers(record.mutable_failed_search(), damage, sensible, state.failed_search->known,
                  state.failed_search->share, state.failed_search->travelled_m);
}

/// The numbers of all patches of a record.
struct PatchNumbers {
  PatchNumbers(map_file::SeenPatches& record, const Damage* damage)
      : planes(*record.mutable_planes(), damage, sensible_patch),
        observations(*record.mutable_looks(), damage, sensible_look) {}

  void operator()(alignment::SeenPatch& patch) {
    planes(patch.offset, patch.since, patch.until);
    observations(patch.normal);
    for (alignment::Observation* observation : {&patch.past, &patch.waiting, &patch.recent})
      observations(observation->weight, observation->distance, observation->by_error);
  }

  RecordNumbers<double> planes;
  RecordNumbers<float> observations;
};

}  // namespace

void write_alignment(AlignmentState state, map_file::Alignment& record) {
  for (AlignmentState::Hypothesis& h : state.hypotheses) visit(*record.add_hypotheses(), h, nullptr);
  record.set_believed(static_cast<std::uint32_t>(state.believed));
  record.set_usual_share(state.usual_share);
  record.set_usual_known(state.usual_known);
  record.set_lidar(state.sensor == SensorKind::lidar);
  record.set_way(state.travelled_m);
  record.set_view(state.view_m);
  record.set_patch(state.patch_m);
  record.set_unsettled(static_cast<std::uint32_t>(state.unsettled));
  visit(record, state, nullptr);
}

AlignmentState read_alignment(map_file::Alignment& record, const std::string& where) {
  const Damage damage{where, "the alignment "};
  const auto require = [&](bool holds, const char* what) { damage.require(holds, what); };
  AlignmentState state;
  require(record.hypotheses_size() <= most_hypotheses, "has too many hypotheses");
  for (map_file::AlignmentHypothesis& hypothesis : *record.mutable_hypotheses())
    visit(hypothesis, state.hypotheses.emplace_back(), &damage);
  require(state.hypotheses.size() >= 2 && state.hypotheses.front().rate_m == 0 &&
              std::all_of(state.hypotheses.begin() + 1, state.hypotheses.end(),
                          [](const AlignmentState::Hypothesis& h) { return h.rate_m > 0; }),
          "lacks hypotheses");
  require(record.has_believed() && record.believed() < state.hypotheses.size(), "believes in none of them");
  visit(record, state, &damage);
  state.believed = record.believed();
  state.usual_share = record.usual_share();
  state.usual_known = record.usual_known();
  state.sensor = record.lidar() ? SensorKind::lidar : SensorKind::depth_camera;
  state.travelled_m = record.way();
  state.view_m = record.view();
  state.patch_m = record.patch();
  state.unsettled = record.unsettled();
  const AlignmentState::Search search = state.failed_search.value_or(AlignmentState::Search{});
  for (const double share : {state.usual_share, state.usual_known, search.known, search.share})
    require(share >= 0 && share <= 1, "has a share that makes no sense");
  for (const double metres : {state.travelled_m, state.view_m, state.patch_m, search.travelled_m})
    require(metres >= 0 && metres <= largest, "has a way that makes no sense");
  return state;
}

void write_patch(alignment::SeenPatches::Change change, map_file::SeenPatches& record) {
  record.add_keys(change.first);
  PatchNumbers(record, nullptr)(change.second);
}

void read_patches(map_file::SeenPatches& record, alignment::SeenPatches::Key block, const std::string& where,
                  alignment::SeenPatches& patches) {
  const Damage damage{where, "the alignment "};
  PatchNumbers numbers(record, &damage);
  std::optional<alignment::SeenPatches::Key> last;
  for (const alignment::SeenPatches::Key key : record.keys()) {
    damage.require(alignment::SeenPatches::block_of(key) == block && (!last || key > *last),
                   "has patches out of order");
    last = key;
    alignment::SeenPatch patch;
    numbers(patch);
    damage.require(std::fabs(patch.normal.norm() - 1) < 1e-3F && patch.past.weight >= 0 &&
                       patch.waiting.weight >= 0 && patch.recent.weight >= 0,
                   sensible_patch.otherwise);
    for (const alignment::Observation* observation : {&patch.past, &patch.waiting, &patch.recent})
      damage.require(std::fabs(double{observation->distance}) <= largest &&
                         observation->by_error.cwiseAbs().maxCoeff() <= largest,
                     sensible_patch.otherwise);
    patches.set(key, patch);
  }
  damage.require(numbers.planes.at_end() && numbers.observations.at_end(), "lacks numbers of patches");
  patches.commit();
}

}  // namespace octosurf::io
