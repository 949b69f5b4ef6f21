#include "io/map_file/alignment_record.hpp"

#include "map_file.pb.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::io {
namespace {

using AlignmentRecord = map_file::Alignment;
using surfaces::AlignmentState;

constexpr int most_hypotheses = 1000;
constexpr double largest = 1e9;  // of any number: real poses and evidence stay far below

/// Appends to a list of numbers.
class AlignmentWriter {
 public:
  explicit AlignmentWriter(google::protobuf::RepeatedField<double>& values) : values_(values) {}
  void put(double value) { values_.Add(value); }
  template <class Derived>
  void put(const Eigen::MatrixBase<Derived>& matrix) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row)
      for (Eigen::Index column = 0; column < matrix.cols(); ++column) put(matrix(row, column));
  }

 private:
  google::protobuf::RepeatedField<double>& values_;
};

class AlignmentReader {
 public:
  AlignmentReader(const google::protobuf::RepeatedField<double>& values, const std::string& where)
      : values_(values), where_(where) {}

  void require(bool holds, const char* what) const {
    if (!holds)
      throw Error(Error::Kind::data, where_, std::string("is damaged: the alignment ") + what,
                  "restore it from a backup");
  }
  double number() {
    require(at_ < values_.size(), "lacks numbers");
    const double value = values_[at_++];
    require(std::fabs(value) <= largest, "has a number that makes no sense");  // NaN fails
    return value;
  }
  template <class Matrix>
  Matrix matrix() {
    Matrix result;
    for (Eigen::Index row = 0; row < result.rows(); ++row)
      for (Eigen::Index column = 0; column < result.cols(); ++column) result(row, column) = number();
    return result;
  }
  Eigen::Isometry3d pose() {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.affine() = matrix<Eigen::Matrix<double, 3, 4>>();
    require_rigid(T, where_);
    return T;
  }
  bool done() const { return at_ == values_.size(); }

 private:
  const google::protobuf::RepeatedField<double>& values_;
  const std::string& where_;
  int at_ = 0;
};

AlignmentState::Hypothesis read_hypothesis(const map_file::AlignmentHypothesis& record,
                                           const std::string& where) {
  AlignmentReader in(record.values(), where);
  AlignmentState::Hypothesis h;
  h.rate_m = in.number();
  in.require(h.rate_m >= 0, "has a rate that makes no sense");
  const double level = in.number();
  in.require(level == 0 || level == 1, "has a rate that makes no sense");
  h.level = level == 1;
  h.log_evidence = in.number();
  h.correction = in.pose();
  h.errors = in.matrix<decltype(h.errors)>();
  h.covariance = in.matrix<decltype(h.covariance)>();
  in.require(in.done(), "has numbers too many");
  const Eigen::SelfAdjointEigenSolver<decltype(h.covariance)> eigen(h.covariance, Eigen::EigenvaluesOnly);
  in.require(eigen.eigenvalues()[0] >= -1e-9 * (1 + h.covariance.trace()), "has a covariance that is none");
  return h;
}

surfaces::AlignmentState::Misfit read_misfit(AlignmentReader& in) {
  surfaces::AlignmentState::Misfit misfit;
  misfit.position = in.matrix<Eigen::Vector3d>();
  misfit.reach_m = in.number();
  const double left_out = in.number();
  in.require(misfit.reach_m >= 0 && (left_out == 0 || left_out == 1), "has a misfit that makes no sense");
  misfit.left_out = left_out == 1;
  return misfit;
}

void write_hypothesis(const AlignmentState::Hypothesis& h, map_file::AlignmentHypothesis& record) {
  AlignmentWriter out(*record.mutable_values());
  out.put(h.rate_m);
  out.put(h.level ? 1 : 0);
  out.put(h.log_evidence);
  out.put(h.correction.affine());
  out.put(h.errors);
  out.put(h.covariance);
}

constexpr int planes_each = 3, looks_each = 3 + 3 * (2 + surfaces::sensor_error_size);

/// A patch's numbers that are floats, in order.
template <class Patch, class Visit>
void for_each_float(Patch& patch, const Visit& visit) {
  for (int i = 0; i < 3; ++i) visit(patch.normal[i]);
  for (auto* look : {&patch.past, &patch.waiting, &patch.recent}) {
    visit(look->weight);
    visit(look->distance);
    for (int i = 0; i < surfaces::sensor_error_size; ++i) visit(look->by_error[i]);
  }
}

}  // namespace

void write_alignment(const surfaces::AlignmentState& state, AlignmentRecord& record) {
  for (const AlignmentState::Hypothesis& h : state.hypotheses) write_hypothesis(h, *record.add_hypotheses());
  record.set_believed(static_cast<std::uint32_t>(state.believed));
  record.set_usual_share(state.usual_share);
  record.set_usual_known(state.usual_known);
  record.set_lidar(state.sensor == SensorKind::lidar);
  record.set_way(state.way_m);
  record.set_view(state.view_m);
  record.set_patch(state.patch_m);
  AlignmentWriter misfits(*record.mutable_misfits());
  for (const surfaces::AlignmentState::Misfit& misfit : state.misfits) {
    misfits.put(misfit.position);
    misfits.put(misfit.reach_m);
    misfits.put(misfit.left_out ? 1 : 0);
  }
  if (state.last) AlignmentWriter(*record.mutable_last()).put(state.last->affine());
  if (state.jump) AlignmentWriter(*record.mutable_jump()).put(state.jump->affine());
  if (state.failed_search)
    AlignmentWriter(*record.mutable_failed_search())
        .put(Eigen::Vector3d(state.failed_search->known, state.failed_search->share,
                             state.failed_search->way_m));
}

surfaces::AlignmentState read_alignment(const AlignmentRecord& record, const std::string& where) {
  surfaces::AlignmentState state;
  const AlignmentReader refuse({}, where);
  refuse.require(record.hypotheses_size() <= most_hypotheses, "has too many hypotheses");
  for (const map_file::AlignmentHypothesis& hypothesis : record.hypotheses())
    state.hypotheses.push_back(read_hypothesis(hypothesis, where));
  for (AlignmentReader misfits(record.misfits(), where); !misfits.done();)
    state.misfits.push_back(read_misfit(misfits));
  refuse.require(record.misfits_size() <= static_cast<int>(5 * surfaces::AlignmentState::most_misfits),
                 "has too many misfits");
  refuse.require(state.hypotheses.size() >= 2 && state.hypotheses.front().rate_m == 0, "lacks hypotheses");
  for (std::size_t i = 1; i < state.hypotheses.size(); ++i)
    refuse.require(state.hypotheses[i].rate_m > 0, "lacks hypotheses");
  refuse.require(record.has_believed() && record.believed() < state.hypotheses.size(),
                 "believes in none of them");
  state.believed = record.believed();
  for (const double share : {record.usual_share(), record.usual_known()})
    refuse.require(share >= 0 && share <= 1, "has a share that makes no sense");
  state.usual_share = record.usual_share();
  state.usual_known = record.usual_known();
  for (const double metres : {record.way(), record.view(), record.patch()})
    refuse.require(metres >= 0 && metres <= largest, "has a way that makes no sense");
  state.sensor = record.lidar() ? SensorKind::lidar : SensorKind::depth_camera;
  state.way_m = record.way();
  state.view_m = record.view();
  state.patch_m = record.patch();
  if (record.last_size() > 0) state.last = AlignmentReader(record.last(), where).pose();
  if (record.jump_size() > 0) state.jump = AlignmentReader(record.jump(), where).pose();
  if (record.failed_search_size() > 0) {
    const Eigen::Vector3d failed_search =
        AlignmentReader(record.failed_search(), where).matrix<Eigen::Vector3d>();
    refuse.require(failed_search.minCoeff() >= 0 && failed_search[0] <= 1 && failed_search[1] <= 1,
                   "has a share that makes no sense");
    state.failed_search = {failed_search[0], failed_search[1], failed_search[2]};
  }
  return state;
}

void write_patch(const surfaces::SeenPatches::Change& change, map_file::SeenPatches& record) {
  const auto& [key, patch] = change;
  record.add_keys(key);
  record.add_planes(patch.offset);
  record.add_planes(patch.since);
  record.add_planes(patch.until);
  for_each_float(patch, [&](float value) { record.add_looks(value); });
}

void read_patches(const map_file::SeenPatches& record, const std::string& where,
                  surfaces::SeenPatches& patches, std::optional<surfaces::SeenPatches::Key>& last) {
  const AlignmentReader refuse({}, where);
  const int count = record.keys_size();
  refuse.require(record.planes_size() == planes_each * count && record.looks_size() == looks_each * count,
                 "lacks numbers of patches");
  const auto sensible = [&](double value) {
    refuse.require(std::fabs(value) <= largest, "has a patch that makes no sense");  // NaN fails
    return value;
  };
  int at = 0;
  for (int i = 0; i < count; ++i) {
    refuse.require(!last || record.keys(i) > *last, "has patches out of order");
    last = record.keys(i);
    surfaces::SeenPatch patch;
    patch.offset = sensible(record.planes(planes_each * i));
    patch.since = sensible(record.planes(planes_each * i + 1));
    patch.until = sensible(record.planes(planes_each * i + 2));
    for_each_float(patch,
                   [&](float& value) { value = static_cast<float>(sensible(double{record.looks(at++)})); });
    refuse.require(std::fabs(patch.normal.norm() - 1) < 1e-3F, "has a patch that makes no sense");
    for (const surfaces::Look* look : {&patch.past, &patch.waiting, &patch.recent})
      refuse.require(look->weight >= 0, "has a patch that makes no sense");
    patches.set(*last, patch);
  }
  patches.commit();
}

}  // namespace octosurf::io
