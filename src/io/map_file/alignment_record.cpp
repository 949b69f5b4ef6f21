#include "io/map_file/alignment_record.hpp"

#include "map_file.pb.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::io {
namespace {

using Record = map_file::Alignment;
using surfaces::AlignmentState;

constexpr int most_hypotheses = 1000;
constexpr double largest = 1e9;  // of any number: poses stay far below, evidence for millions of scans

/// One after the other into a list of numbers.
class Writer {
 public:
  explicit Writer(google::protobuf::RepeatedField<double>& values) : values_(values) {}
  void put(double value) { values_.Add(value); }
  template <class Derived>
  void put(const Eigen::MatrixBase<Derived>& matrix) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row)
      for (Eigen::Index column = 0; column < matrix.cols(); ++column) put(matrix(row, column));
  }

 private:
  google::protobuf::RepeatedField<double>& values_;
};

class Reader {
 public:
  Reader(const google::protobuf::RepeatedField<double>& values, const std::string& where)
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

/// What is there of a walk, of the correction and of what is common, becomes all of a steady drift.
void read_steady(Reader& in, AlignmentState::Hypothesis& h) {
  const double drift = in.number();
  in.require(drift == 1 || drift == 2, "has a drift that makes no sense");
  h.drift = drift == 1 ? AlignmentState::Drift::of_frame : AlignmentState::Drift::of_sensor;
  h.velocity = in.matrix<Twist>();
  h.covariance.conservativeResize(18, 18);
  for (const Eigen::Index with : {0, 6, 12}) {
    const auto block = in.matrix<TwistCovariance>();
    h.covariance.block<6, 6>(with, 12) = block.transpose();
    h.covariance.block<6, 6>(12, with) = block;
  }
}

AlignmentState::Hypothesis read_hypothesis(const map_file::AlignmentHypothesis& record,
                                           const std::string& where) {
  Reader in(record.values(), where);
  AlignmentState::Hypothesis h;
  h.rate_m = in.number();
  h.rate_rad = in.number();
  h.factor = in.number();
  h.common_share = in.number();
  h.lasting = in.number();
  in.require(h.rate_m >= 0 && h.rate_rad >= 0 && h.factor > 0, "has a rate that makes no sense");
  in.require(h.common_share >= 0 && h.lasting >= 0 && h.lasting < 1, "has errors that make no sense");
  h.log_evidence = in.number();
  h.correction = in.pose();
  h.common = in.matrix<Twist>();
  h.covariance.topLeftCorner<6, 6>() = in.matrix<TwistCovariance>();
  h.covariance.bottomRightCorner<6, 6>() = in.matrix<TwistCovariance>();
  h.covariance.topRightCorner<6, 6>() = in.matrix<TwistCovariance>();
  h.covariance.bottomLeftCorner<6, 6>() = h.covariance.topRightCorner<6, 6>().transpose();
  in.require(in.done(), "has numbers too many");
  if (!record.steady().empty()) {
    Reader steady(record.steady(), where);
    read_steady(steady, h);
    in.require(steady.done(), "has numbers too many");
  }
  const Eigen::SelfAdjointEigenSolver<AlignmentState::Hypothesis::Covariance> eigen(h.covariance,
                                                                                    Eigen::EigenvaluesOnly);
  in.require(eigen.eigenvalues()[0] >= -1e-9 * (1 + h.covariance.trace()), "has a covariance that is none");
  return h;
}

surfaces::AlignmentState::Misfit read_misfit(Reader& in) {
  surfaces::AlignmentState::Misfit misfit;
  misfit.position = in.matrix<Eigen::Vector3d>();
  misfit.reach_m = in.number();
  const double left_out = in.number();
  in.require(misfit.reach_m >= 0 && (left_out == 0 || left_out == 1), "has a misfit that makes no sense");
  misfit.left_out = left_out == 1;
  return misfit;
}

void write_hypothesis(const AlignmentState::Hypothesis& h, map_file::AlignmentHypothesis& record) {
  Writer out(*record.mutable_values());
  out.put(h.rate_m);
  out.put(h.rate_rad);
  out.put(h.factor);
  out.put(h.common_share);
  out.put(h.lasting);
  out.put(h.log_evidence);
  out.put(h.correction.affine());
  out.put(h.common);
  out.put(h.covariance.topLeftCorner<6, 6>());
  out.put(h.covariance.block<6, 6>(6, 6));
  out.put(h.covariance.block<6, 6>(0, 6));
  if (h.drift == AlignmentState::Drift::walk) return;
  Writer steady(*record.mutable_steady());
  steady.put(h.drift == AlignmentState::Drift::of_frame ? 1 : 2);
  steady.put(h.velocity);
  for (const Eigen::Index with : {0, 6, 12}) steady.put(h.covariance.block<6, 6>(12, with));
}

}  // namespace

void write_alignment(const surfaces::AlignmentState& state, Record& record) {
  for (const AlignmentState::Hypothesis& h : state.hypotheses) write_hypothesis(h, *record.add_hypotheses());
  record.set_believed(static_cast<std::uint32_t>(state.believed));
  record.set_usual_share(state.usual_share);
  record.set_usual_known(state.usual_known);
  record.set_noise_factor2(state.noise_factor2);
  record.set_common_share(state.common_share);
  record.set_scans_learned(state.scans_learned);
  Writer misfits(*record.mutable_misfits());
  for (const surfaces::AlignmentState::Misfit& misfit : state.misfits) {
    misfits.put(misfit.position);
    misfits.put(misfit.reach_m);
    misfits.put(misfit.left_out ? 1 : 0);
  }
  if (state.last) Writer(*record.mutable_last()).put(state.last->affine());
  if (state.jump) Writer(*record.mutable_jump()).put(state.jump->affine());
}

surfaces::AlignmentState read_alignment(const Record& record, const std::string& where) {
  surfaces::AlignmentState state;
  const Reader refuse({}, where);
  refuse.require(record.hypotheses_size() <= most_hypotheses, "has too many hypotheses");
  bool still = false, drifting = false;
  for (const map_file::AlignmentHypothesis& hypothesis : record.hypotheses()) {
    state.hypotheses.push_back(read_hypothesis(hypothesis, where));
    (state.hypotheses.back().rate_m == 0 ? still : drifting) = true;
  }
  refuse.require(still && drifting, "lacks hypotheses");
  refuse.require(record.has_believed() && record.believed() < state.hypotheses.size(),
                 "believes in none of them");
  state.believed = record.believed();
  for (const double share : {record.usual_share(), record.usual_known()})
    refuse.require(share >= 0 && share <= 1, "has a share that makes no sense");
  state.usual_share = record.usual_share();
  state.usual_known = record.usual_known();
  refuse.require(record.noise_factor2() >= 1 && record.noise_factor2() <= largest &&
                     record.common_share() >= 0 && record.common_share() <= largest,
                 "has an error that makes no sense");
  state.noise_factor2 = record.noise_factor2();
  state.common_share = record.common_share();
  state.scans_learned = record.scans_learned();
  refuse.require(record.misfits_size() <= static_cast<int>(5 * surfaces::AlignmentState::most_misfits),
                 "has too many misfits");
  for (Reader misfits(record.misfits(), where); !misfits.done();)
    state.misfits.push_back(read_misfit(misfits));
  if (record.last_size() > 0) state.last = Reader(record.last(), where).pose();
  if (record.jump_size() > 0) state.jump = Reader(record.jump(), where).pose();
  return state;
}

}  // namespace octosurf::io
