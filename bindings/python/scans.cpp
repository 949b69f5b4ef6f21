// octosurf/scan.hpp and scan_source.hpp in Python: scans to insert, and recordings.
#include "arrays.hpp"
#include "bind.hpp"
#include "scan_arrays.hpp"
#include "values.hpp"

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <octosurf/deskew.hpp>
#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/scan_source.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

namespace fs = std::filesystem;
using Times = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// A source with a lock, for several threads.
class Recording {
 public:
  explicit Recording(std::unique_ptr<ScanSource> source) : source_(std::move(source)) {}

  std::size_t size() const { return source_->size(); }

  std::unique_ptr<Scan> next() {
    {
      const py::gil_scoped_release others_run;
      const std::lock_guard alone(busy_);
      if (std::optional<Scan> scan = source_->next()) return std::make_unique<Scan>(*std::move(scan));
    }
    throw py::stop_iteration();
  }

  std::vector<std::string> skipped() {
    const py::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    return source_->skipped();
  }

  Eigen::Vector3d origin() const { return source_->origin(); }

  std::vector<std::string> notes() {
    const py::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    return source_->notes();
  }

 private:
  std::mutex busy_;
  std::unique_ptr<ScanSource> source_;
};

std::unique_ptr<Recording> opened(std::variant<fs::path, std::vector<fs::path>> inputs,
                                  ScanSourceOptions options) {
  if (const auto* one = std::get_if<fs::path>(&inputs)) inputs = std::vector<fs::path>{*one};
  const py::gil_scoped_release others_run;
  return std::make_unique<Recording>(open_scans(std::get<1>(inputs), options));
}

void bind_scan(py::module_& module) {
  Value<Scan>(module, "Scan", "One posed scan, which owns its points; does not change.")
      .rows("points", &Scan::points, "(N, 3) float32, sensor frame, m; a read-only view.")
      .rows("origins", &Scan::origins,
            "(N, 3) float32, where each reading's ray starts, sensor frame at stamp_s, m; empty: at 0.")
      .rows("free_rays", &Scan::free_rays,
            "(M, 3) float32, ends of rays that met nothing up to there and free space, sensor frame, m.")
      .field<Times>(
          "times_s", [](const Scan& self) { return moved_array(std::vector<float>(self.times_s)); },
          [](Scan& self, const Times& given) {
            self.times_s.assign(given.data(), given.data() + given.size());
          },
          "(N,) float32, when each reading was taken, s after stamp_s; empty: all at once; a copy.")
      .field("T_map_sensor", &Scan::T_map_sensor, "(4, 4) float64, sensor frame to map frame; a copy.")
      .field("stamp_s", &Scan::stamp_s, "s.")
      .field("sensor", &Scan::sensor, R"("depth_camera" or "lidar".)")
      .field("name", &Scan::name, "File or index.")
      .def(
          py::init([](const Points& points, const Eigen::Isometry3d& T_map_sensor, double stamp_s,
                      SensorKind sensor, std::string name) {
            require_shape(points);
            Scan scan{{}, T_map_sensor, stamp_s, sensor, std::move(name)};
            copy_points(points, scan.points);
            return scan;
          }),
          py::arg("points"), py::arg("T_map_sensor"), py::kw_only(), py::arg("stamp_s") = 0.0,
          py::arg("sensor") = SensorKind::depth_camera, py::arg("name") = "",
          R"(points: (..., 3), m, in the sensor's frame, copied as float32; what is not finite is "no reading".
T_map_sensor: (4, 4), sensor frame to map frame, a rigid motion.
stamp_s: when it was taken, s. sensor: "depth_camera" or "lidar", picks the default maximum range.
name: for messages.)")
      .def_static(
          "from_depth",
          [](const py::array& depth, const py::object& intrinsics, const Eigen::Isometry3d& T_map_camera,
             double depth_scale, double stamp_s, std::string name) {
            return Scan{points_of_depth(depth, intrinsics, depth_scale), T_map_camera, stamp_s,
                        SensorKind::depth_camera, std::move(name)};
          },
          py::arg("depth"), py::arg("intrinsics"), py::arg("T_map_camera"), py::kw_only(),
          py::arg("depth_scale") = 1000.0, py::arg("stamp_s") = 0.0, py::arg("name") = "",
          R"(From a depth image of a pinhole camera without distortion; x right, y down, z along the optical axis.

depth: (H, W) uint16 with `depth_scale` units per metre, 0 and 65535 for no reading; or float32 or float64 in metres,
0, negative and not finite for no reading (`depth_scale` is not used).
intrinsics: (fx, fy, cx, cy) or K, (3, 3); pixels. T_map_camera: (4, 4), camera frame to map frame.)")
      .def(
          "with_pose",
          [](const Scan& self, const Eigen::Isometry3d& T_map_sensor) {
            Scan moved = self;
            moved.T_map_sensor = T_map_sensor;
            return moved;
          },
          py::arg("T_map_sensor"), "A copy of it at another pose, (4, 4).")
      .def(
          "deskewed",
          [](const Scan& self, const std::optional<Times>& times_s, const std::vector<double>& stamps_s,
             const std::vector<Eigen::Isometry3d>& poses) {
            if (stamps_s.size() != poses.size())
              throw Error(Error::Kind::data, "stamps_s", "are not as many as the poses", "give one to each");
            Scan scan = self;
            if (times_s) scan.times_s.assign(times_s->data(), times_s->data() + times_s->size());
            std::vector<StampedPose> stamped;
            for (std::size_t i = 0; i < poses.size(); ++i) stamped.push_back({stamps_s[i], poses[i]});
            const py::gil_scoped_release others_run;
            return deskew(std::move(scan), stamped);
          },
          py::arg("times_s"), py::arg("stamps_s"), py::arg("poses"),
          R"(A copy with the sensor's motion within the scan undone: its points where they were in the sensor's frame at
stamp_s, their rays from where the sensor was. times_s: (N,), s after stamp_s, one for each point; None: its own.
stamps_s: (M,), ascending, and poses: (M, 4, 4), T_map_sensor, interpolated between, from the first to the last reading.)")
      .def("__len__", [](const Scan& self) { return self.points.size(); });
}

}  // namespace

void bind_scans(py::module_& module) {
  bind_scan(module);
  py::class_<Recording>(module, "ScanSource",
                        "Posed scans, one after the other, decoded as they are asked for.")
      .def("__len__", &Recording::size, "Number of scans listed, bad ones included.")
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &Recording::next, "Throws Error(data) with its name for a scan that cannot be read.")
      .def("__repr__",
           [](const Recording& self) { return "<ScanSource of " + std::to_string(self.size()) + " scans>"; })
      .def_property_readonly("origin", &Recording::origin, "Subtracted from all coordinates, (3), m.")
      .def("notes", &Recording::notes, "What was chosen among what the recording has, a line each.")
      .def("skipped", &Recording::skipped, "A line for every scan that was left out so far, and why.");
  module.def(
      "open_scans",
      [](std::variant<fs::path, std::vector<fs::path>> inputs, std::optional<fs::path> poses,
         std::optional<fs::path> intrinsics, std::optional<double> depth_scale,
         std::optional<std::size_t> fields, std::optional<double> rate_hz,
         std::optional<double> max_pose_gap_s, std::optional<Eigen::Vector3d> origin,
         std::vector<std::string> topics, std::optional<std::string> pose_topic,
         std::optional<std::string> pose_frame, std::optional<std::string> fixed_frame,
         std::optional<std::string> info_topic, bool skip_bad, bool deskewed,
         std::optional<SensorKind> sensor, std::optional<double> cloud_scale, std::vector<double> no_return,
         const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& self_boxes,
         double clear_no_return_m) {
        ScanSourceOptions options;
        options.deskew = deskewed ? Deskew::automatic : Deskew::off;
        options.poses = std::move(poses);
        options.intrinsics = std::move(intrinsics);
        options.depth_scale = depth_scale;
        options.fields = fields;
        options.rate_hz = rate_hz;
        options.max_pose_gap_s = max_pose_gap_s;
        options.origin = origin;
        options.bag = {std::move(topics), std::move(pose_topic), std::move(pose_frame),
                       std::move(fixed_frame), std::move(info_topic)};
        options.skip_bad = skip_bad;
        options.sensor = sensor;
        options.cloud_scale = cloud_scale;
        options.no_return = std::move(no_return);
        for (const auto& [a, b] : self_boxes)
          options.self_boxes.push_back({{a.cwiseMin(b).eval(), a.cwiseMax(b).eval()}, {}});
        options.clear_no_return_m = clear_no_return_m;
        return opened(std::move(inputs), options);
      },
      py::arg("inputs"), py::kw_only(), py::arg("poses") = py::none(), py::arg("intrinsics") = py::none(),
      py::arg("depth_scale") = py::none(), py::arg("fields") = py::none(), py::arg("rate_hz") = py::none(),
      py::arg("max_pose_gap_s") = py::none(), py::arg("origin") = py::none(),
      py::arg("topics") = std::vector<std::string>(), py::arg("pose_topic") = py::none(),
      py::arg("pose_frame") = py::none(), py::arg("fixed_frame") = py::none(),
      py::arg("info_topic") = py::none(), py::arg("skip_bad") = false, py::arg("deskew") = true,
      py::arg("sensor") = py::none(), py::arg("cloud_scale") = py::none(),
      py::arg("no_return") = std::vector<double>(),
      py::arg("self_boxes") = std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>(),
      py::arg("clear_no_return_m") = 0.0,
      R"(Opens a recording, or a list of them, one after the other: what `octosurf map` reads.

7-Scenes, TUM RGB-D and KITTI folders, 16-bit depth images (PNG, PGM), PCD, PLY, OctoMap's .graph,
bags of ROS 1 (.bag) and ROS 2 (.db3, .mcap, or their folder).
poses: a file with one pose per scan, or a stamped trajectory; wins over what lies beside the scans.
intrinsics: a file with K or `fx fy cx cy`. depth_scale: units per metre; None: 5000 for TUM folders, else 1000.
fields: floats of a point in velodyne files; None: 4, or what their values say.
rate_hz: of scans without time stamps; None: 30 for depth cameras, 10 for lidar.
max_pose_gap_s: a pose is interpolated between neighbours at most so far apart; None: 0.1, and 0.25 in bags.
origin: subtracted from all coordinates, m; None: 0, or near the first scan if that is over 8192 m from 0.
Of bags: topics, of clouds or depth images; pose_topic, instead of tf, and pose_frame, whose poses those are; fixed_frame,
the map's in tf; info_topic, CameraInfo. What is not given is chosen where there is no choice, see notes().
skip_bad: go on after a scan that cannot be read or whose pose is not a rigid motion.
deskew: undo the sensor's motion within scans by their points' times.
Of clouds: sensor, "depth_camera" or "lidar"; None: what their rays' directions say. cloud_scale: units per metre; None: 1.
no_return: ranges, of cameras depths, that stand for no return, m; empty: far values that many readings have; [0]: none.
self_boxes: pairs of corners in the sensor's frame, m: readings in them are the robot's own and left out.
clear_no_return_m: rays without a return free space up to this range; 0: they do not.
Throws Error(usage, data).)");
}

}  // namespace octosurf::python
