// octosurf/scan.hpp and scan_source.hpp in Python: scans to insert, and recordings.
#include "bind.hpp"
#include "io/readers/depth_image.hpp"

#include <cmath>
#include <variant>

#include <octosurf/deskew.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::python {
namespace {

namespace fs = std::filesystem;
using Times = Dense<float>;

constexpr int largest_image = 1 << 16;  ///< pixels a side

[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& hint) {
  throw Error(Error::Kind::data, where, what, hint);
}

std::string shape_of(const py::array& array) { return py::str(array.attr("shape")); }

io::Intrinsics camera_of(const py::object& given) {
  const auto numbers = dense<double>(given);
  if (numbers.ndim() != (numbers.size() == 4 ? 1 : 2))
    refuse("intrinsics", "have shape " + shape_of(numbers), "give (fx, fy, cx, cy) or K, (3, 3)");
  return io::intrinsics_of({numbers.data(), numbers.data() + numbers.size()}, "intrinsics");
}

template <class Number>
std::vector<Eigen::Vector3f> points_of(const Dense<Number>& depth, const io::Intrinsics& camera,
                                       double scale) {
  const auto width = static_cast<std::size_t>(depth.shape(1));
  const auto pixel = [&](std::size_t u, std::size_t v) { return depth.data()[v * width + u]; };
  const py::gil_scoped_release others_run;
  return io::back_project(width, static_cast<std::size_t>(depth.shape(0)), camera, scale, pixel);
}

using Recording = Locked<std::unique_ptr<ScanSource>>;

std::unique_ptr<Scan> next_scan(Recording& recording) {
  std::optional<Scan> scan = recording.use([](const auto& source) { return source->next(); });
  if (!scan) throw py::stop_iteration();
  return std::make_unique<Scan>(*std::move(scan));
}

/// Calls a method of the source while it is locked.
template <class Answer>
auto under_lock(Answer (ScanSource::*method)() const) {
  return [method](Recording& self) {
    return self.use([method](const auto& source) { return ((*source).*method)(); });
  };
}

void set_times(Scan& scan, const Times& given) {
  scan.times_s.assign(given.data(), given.data() + given.size());
}

Scan deskewed(Scan scan, const std::vector<std::pair<double, Eigen::Isometry3d>>& poses,
              const std::optional<Times>& times_s) {
  if (times_s) set_times(scan, *times_s);
  std::vector<StampedPose> stamped;
  for (const auto& [stamp_s, pose] : poses) stamped.push_back({stamp_s, pose});
  const py::gil_scoped_release others_run;
  return deskew(std::move(scan), stamped);
}

Scan deskewed_by_arrays(Scan scan, const std::optional<Times>& times_s, const std::vector<double>& stamps_s,
                        const std::vector<Eigen::Isometry3d>& poses) {
  if (stamps_s.size() != poses.size())
    throw Error(Error::Kind::data, "stamps_s", "are not as many as the poses", "give one to each");
  std::vector<std::pair<double, Eigen::Isometry3d>> stamped;
  for (std::size_t i = 0; i < poses.size(); ++i) stamped.emplace_back(stamps_s[i], poses[i]);
  return deskewed(std::move(scan), stamped, times_s);
}

/// The headers' words on it and on its options.
std::string open_scans_doc() {
  std::string doc = doc_of("open_scans") + std::string("\n");
  for (const std::string name : {"poses", "intrinsics", "depth_scale", "pose_form", "viewpoint", "origin",
                                 "skip_bad", "sensor", "no_return", "self_boxes"})
    doc += "\n" + name + ": " + field_doc("ScanSourceOptions." + name, "", name != "no_return");
  for (const std::string name : {"topics", "pose_topic", "pose_frame", "fixed_frame"})
    doc += "\n" + name + ": " + field_doc("BagOptions." + name, "", true);
  return doc + "\nA box is a pair of corners in the sensor's frame, m. Throws Error(usage, data).";
}

void bind_scan(Module& module) {
  Value<Scan>(module, "Scan", "One posed scan, which owns its points; does not change.")
      .fields(OCTOSURF_FIELDS(Scan, points, origins, free_rays))
      .field(
          "times_s", [](const Scan& self) { return moved_array(std::vector<float>(self.times_s)); },
          "(N,) float32, when each reading was taken, s after stamp_s; empty: all at once; a copy.")
      .fields(OCTOSURF_FIELDS(Scan, T_map_sensor, stamp_s, sensor, name))
      .def(
          py::init([](const Points& points, const Eigen::Isometry3d& T_map_sensor, double stamp_s,
                      SensorKind sensor, std::string name) {
            require_shape(points);
            Scan scan{{}, T_map_sensor, stamp_s, sensor, std::move(name)};
            copy_points(points, scan.points);
            return scan;
          }),
          "points"_a, "T_map_sensor"_a, py::kw_only(), "stamp_s"_a = 0.0,
          "sensor"_a = SensorKind::depth_camera, "name"_a = "",
          R"(points: (..., 3), m, in the sensor's frame, copied as float32; what is not finite is "no reading".
T_map_sensor: (4, 4), sensor frame to map frame, a rigid motion.
stamp_s: when it was taken, s. sensor: "depth_camera" or "lidar", picks the default maximum range.
name: for messages.)")
      .def_static(
          "from_depth", &scan_of_depth, "depth"_a, "intrinsics"_a, "T_map_camera"_a, py::kw_only(),
          "depth_scale"_a = 1000.0, "stamp_s"_a = 0.0, "name"_a = "",
          R"(From a depth image of a pinhole camera without distortion; x right, y down, z along the optical axis.

depth: (H, W) uint16 with `depth_scale` units per metre, 0 and 65535 for no reading; or float32 or float64 in metres,
0, negative and not finite for no reading (`depth_scale` is not used). Less than a millimetre is none either.
intrinsics: (fx, fy, cx, cy) or K, (3, 3); pixels. T_map_camera: (4, 4), camera frame to map frame.)")
      .def(
          "with_pose",
          [](const Scan& self, const Eigen::Isometry3d& T_map_sensor) {
            Scan moved = self;
            moved.T_map_sensor = T_map_sensor;
            return moved;
          },
          "T_map_sensor"_a, "A copy of it at another pose, (4, 4).")
      .def(
          "deskewed", &deskewed_by_arrays, "times_s"_a, "stamps_s"_a, "poses"_a,
          R"(A copy with the sensor's motion within the scan undone: its points where they were in the sensor's frame at
stamp_s, their rays from where the sensor was. times_s: (N,), s after stamp_s, one for each point; None: its own.
stamps_s: (M,), ascending, and poses: (M, 4, 4), T_map_sensor, interpolated between, from the first to the last reading.)")
      .def("__len__", [](const Scan& self) { return self.points.size(); });
}

}  // namespace

void require_shape(const Points& points) {
  if (points.ndim() == 2 && points.shape(0) == 3 && points.shape(1) != 3)
    refuse("points", "are columns, " + shape_of(points), "give rows: points.T");
  if (points.ndim() < 1 || points.shape(points.ndim() - 1) != 3)
    refuse("points", "have shape " + shape_of(points), "give x, y, z in the last dimension");
}

void copy_points(const Points& points, std::vector<Eigen::Vector3f>& to) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const auto* const first = reinterpret_cast<const Eigen::Vector3f*>(points.data());
  to.assign(first, first + points.size() / 3);
}

Scan scan_of_depth(const py::array& depth, const py::object& intrinsics,
                   const Eigen::Isometry3d& T_map_camera, double depth_scale, double stamp_s,
                   std::string name) {
  if (depth.ndim() != 2 || depth.shape(0) > largest_image || depth.shape(1) > largest_image)
    refuse("depth", "has shape " + shape_of(depth), "give an image, (H, W)");
  const io::Intrinsics camera = camera_of(intrinsics);
  const bool metres = depth.dtype().kind() == 'f';
  if (!metres && !(depth.dtype().kind() == 'u' && depth.dtype().attr("itemsize").cast<int>() == 2))
    refuse("depth", "is of " + std::string(py::str(depth.dtype())),
           "give uint16 units, or float32 or float64 metres");
  if (!metres && (!(depth_scale > 0) || !std::isfinite(depth_scale)))
    refuse("depth_scale", "is not positive", "give units per metre");
  return {metres ? points_of<float>(depth, camera, 1) : points_of<std::uint16_t>(depth, camera, depth_scale),
          T_map_camera, stamp_s, SensorKind::depth_camera, std::move(name)};
}

void bind_scans(Module& module) {
  bind_scan(module);
  module.def("deskew", &deskewed, "scan"_a, "poses"_a, py::kw_only(), "times_s"_a = py::none(),
             "Scan.deskewed(), with `poses` as pairs of a stamp, s, ascending, and T_map_sensor, (4, 4).");
  Class<Recording>(module, "ScanSource", "Posed scans, one after the other, decoded one at a time.")
      .def("__len__", under_lock(&ScanSource::size), doc_of("ScanSource.size"))
      .def("__iter__", [](Recording& self) -> Recording& { return self; })
      .def("__next__", &next_scan, "Throws Error(data) with its name for a scan that cannot be read.")
      .def("notes", under_lock(&ScanSource::notes))
      .def("skipped", under_lock(&ScanSource::skipped))
      .def_property_readonly("origin", under_lock(&ScanSource::origin),
                             "Subtracted from all coordinates, (3), m.");
  module.def(
      "open_scans",
      [](std::variant<fs::path, std::vector<fs::path>> inputs, std::optional<fs::path> poses,
         std::optional<fs::path> intrinsics, std::optional<double> depth_scale,
         std::optional<PoseForm> pose_form, std::optional<Eigen::Vector3d> viewpoint,
         std::optional<Eigen::Vector3d> origin, std::vector<std::string> topics,
         std::optional<std::string> pose_topic, std::optional<std::string> pose_frame,
         std::optional<std::string> fixed_frame, bool skip_bad, std::optional<SensorKind> sensor,
         std::vector<double> no_return,
         const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& self_boxes) {
        ScanSourceOptions options{
            std::move(poses), std::move(intrinsics), depth_scale, pose_form, viewpoint, origin};
        options.bag = {std::move(topics), std::move(pose_topic), std::move(pose_frame),
                       std::move(fixed_frame)};
        options.skip_bad = skip_bad;
        options.sensor = sensor;
        options.no_return = std::move(no_return);
        for (const auto& [a, b] : self_boxes)
          options.self_boxes.push_back({{a.cwiseMin(b).eval(), a.cwiseMax(b).eval()}, {}});
        if (const auto* one = std::get_if<fs::path>(&inputs)) inputs = std::vector<fs::path>{*one};
        return std::make_unique<Recording>(open_scans(std::get<1>(inputs), options));
      },
      "inputs"_a, py::kw_only(), "poses"_a = py::none(), "intrinsics"_a = py::none(),
      "depth_scale"_a = py::none(), "pose_form"_a = py::none(), "viewpoint"_a = py::none(),
      "origin"_a = py::none(), "topics"_a = std::vector<std::string>(), "pose_topic"_a = py::none(),
      "pose_frame"_a = py::none(), "fixed_frame"_a = py::none(), "skip_bad"_a = false,
      "sensor"_a = py::none(), "no_return"_a = std::vector<double>(),
      "self_boxes"_a = std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>(), Released(),
      open_scans_doc().c_str());
}

}  // namespace octosurf::python
