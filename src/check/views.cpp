#include "check/views.hpp"

#include "judgement/pair.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

namespace octosurf::check {

Views::Views(const Recording& recording, const Meaning& readings, std::size_t count)
    : recording_(&recording), readings_(readings) {
  const auto& kept = recording.kept();
  count = std::min(count, kept.size());
  for (std::size_t k = 0; k < count; ++k) {
    const Recording::KeptScan& scan = kept[k * kept.size() / count];
    judgement::View view;
    view.scan = scan.index;
    view.camera = scan.scan.sensor == SensorKind::depth_camera;
    view.points = readings.readings_of(scan.scan);
    view.finish();
    views_.push_back(std::move(view));
  }
}

double Views::second_direction(const Meaning& meaning) const {
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const judgement::View& view : views_) {
    const auto T = meaning.pose_of(*recording_, view.scan);
    for (const judgement::Sample& sample : view.samples) {
      if (!T || !sample.flat) continue;
      const Eigen::Vector3d normal = T->linear() * sample.normal.cast<double>();
      squares += normal * normal.transpose();
    }
  }
  if (squares.isZero()) return 0;
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares).eigenvalues()[1] / squares.trace();
}

Score Views::score(const Meaning& meaning, double voxels, std::vector<judgement::Offset>* offsets) const {
  std::vector<judgement::View> posed;
  for (const judgement::View& view : views_) {
    const auto T = meaning.pose_of(*recording_, view.scan);
    if (!T || view.points.empty()) continue;
    posed.push_back(view);
    posed.back().number = posed.size();
    posed.back().T_map_view = *T;
    if (offsets == nullptr) continue;
    if (view.scan > 0) posed.back().T_map_before = meaning.pose_of(*recording_, view.scan - 1);
    if (view.scan + 1 < recording_->poses().size())
      posed.back().T_map_after = meaning.pose_of(*recording_, view.scan + 1);
  }
  std::vector<const judgement::View*> pointers;
  for (const judgement::View& view : posed) pointers.push_back(&view);
  const judgement::Tolerance tolerance(pointers, voxels * recording_->parameters().occupancy.resolution);
  std::vector<judgement::Offset> ignored;
  Score score;
  for (std::size_t i = 0; i < posed.size(); ++i)
    for (std::size_t j = i + 1; j < posed.size(); ++j) {
      if (posed[i].scan < meaning.first_session && posed[j].scan >= meaning.first_session) continue;
      const judgement::Places places =
          judgement::compare(posed[i], posed[j], tolerance, offsets == nullptr ? ignored : *offsets);
      score.places += places.all();
      score.apart += places.apart();
    }
  return score;
}

Judgement judge(const Recording& recording, const Meaning& meaning) {
  RecordingJudge judge(recording.parameters());
  for (const Recording::KeptScan& kept : recording.kept()) {
    const auto T = meaning.pose_of(recording, kept.index);
    if (!T || kept.index >= meaning.first_session) continue;
    Scan scan = kept.scan;
    scan.points = meaning.readings_of(kept.scan);
    scan.T_map_sensor = *T;
    judge.add(scan, *T);
  }
  return judge.judge();
}

}  // namespace octosurf::check
