// octosurf/mapper.hpp and map_alignment.hpp in Python.
#include "bind.hpp"
#include "fields.hpp"
#include "map_holder.hpp"
#include "scan_arrays.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/map_alignment.hpp>
#include <octosurf/mapper.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

/// Python's Mapper: the map it keeps up to date, and room for the points of the scan at hand.
class PythonMapper {
 public:
  PythonMapper(MapPtr map, int threads) : map_(std::move(map)) { map_->take_over(threads); }

  const MapPtr& map() const { return map_; }

  ScanReport insert(const Scan& scan) {
    return map_->write([&scan](Mapper& mapper) { return mapper.insert(scan); });
  }

  std::vector<ScanReport> insert_all(const std::vector<Scan>& scans) {
    return map_->write([&scans](Mapper& mapper) { return mapper.insert_all(scans); });
  }

  ScanReport drain() {
    return map_->write([](Mapper& mapper) { return mapper.drain(); });
  }

  /// Points are copied to where the scan's before lay: fresh memory would cost more than the copying does.
  ScanReport insert_points(const Points& points, const Eigen::Isometry3d& T_map_sensor, double stamp_s,
                           SensorKind sensor, std::string name) {
    require_shape(points);
    return map_->write([&](Mapper& mapper) {
      copy_points(points, scan_.points);
      scan_.T_map_sensor = T_map_sensor;
      scan_.stamp_s = stamp_s;
      scan_.sensor = sensor;
      scan_.name = std::move(name);
      return mapper.insert(scan_);
    });
  }

  ScanReport insert_depth(const py::array& depth, const py::object& intrinsics,
                          const Eigen::Isometry3d& T_map_camera, double depth_scale, double stamp_s,
                          std::string name) {
    return insert(Scan{points_of_depth(depth, intrinsics, depth_scale), T_map_camera, stamp_s,
                       SensorKind::depth_camera, std::move(name)});
  }

  ScanReport detect_in_occupancy() {
    return map_->write([](Mapper& mapper) { return mapper.detect_in_occupancy(); });
  }

  MergeReport merge(const MapPtr& other, const Eigen::Isometry3d& T_map_other) {
    if (other == map_)
      throw Error(Error::Kind::usage, "other", "is the map itself, whose readings would count twice",
                  "give another one");
    return map_->write_with(
        *other, [&](Mapper& mapper, const Map& theirs) { return mapper.merge(theirs, T_map_other); });
  }

  void share_octree(bool on) {
    map_->configure([on](Mapper& mapper) { mapper.share_octree(on); });
  }

  void remember_scans() {
    map_->configure([](Mapper& mapper) { mapper.remember_scans(); });
  }

 private:
  MapPtr map_;
  Scan scan_;
};

std::map<std::string, double> stages_of(const ScanReport& report) {
  std::map<std::string, double> stages;
  for (std::size_t i = 0; i < stage_names.size(); ++i)
    stages[std::string(stage_names[i])] = report.stage_ms[i];
  return stages;
}

void bind_report(py::module_& module) {
  using R = ScanReport;
  Value<R>(module, "ScanReport", "What one scan did.")
      .field("points_raw", &R::points_raw, "Handed in.")
      .field("points_not_finite", &R::points_not_finite, "No reading.")
      .field("points_too_near", &R::points_too_near, "Dropped: nearer than min_range.")
      .field("points_beyond_range", &R::points_beyond_range, "Not mapped, but free space up to max_range.")
      .field("points_out_of_map", &R::points_out_of_map, "Dropped: outside the octree.")
      .field("voxels", &R::voxels, "Distinct end voxels.")
      .field("appeared", &R::appeared, "Voxels that became occupied.")
      .field("vanished", &R::vanished, "Voxels that no longer are.")
      .field("categorized", &R::categorized, "Of the appeared, in a surface when insert() returned.")
      .field("added", &R::added, "New inliers of surfaces there before, inside them or at their rims.")
      .field("expanded", &R::expanded, "The same, over their boundaries.")
      .field("detected", &R::detected, "The same, given to them by detection.")
      .field("waiting", &R::waiting, "New points in blocks whose turn has not come: Mapper.drain().")
      .field("alignment", &R::alignment, "Alignment; its T_map_sensor is what the scan was inserted with.")
      .field("born", &R::born, "Surface ids.")
      .field("grown", &R::grown, "Surface ids.")
      .field("shrunk", &R::shrunk, "Surface ids.")
      .field("merged", &R::merged, "Surface ids.")
      .field("gone", &R::gone, "Surface ids.")
      .field<std::map<std::string, double>>(
          "stage_ms", &stages_of,
          [](R& report, const std::map<std::string, double>& stages) {
            for (std::size_t i = 0; i < stage_names.size(); ++i)
              report.stage_ms[i] = stages.at(std::string(stage_names[i]));
          },
          "dict of ms by stage: align, downsample, occupancy, …")
      .field("total_ms", &R::total_ms, "ms.")
      .text([](const R& report) {
        return "<ScanReport: " + std::to_string(report.points_raw) + " points, " +
               std::to_string(report.appeared) + " voxels appeared, " + std::to_string(report.vanished) +
               " vanished, " + std::to_string(report.born.size()) + " surfaces born>";
      });
}

void bind_merge_report(py::module_& module) {
  using S = MergedSurface;
  Value<S>(module, "MergedSurface", "What became of another map's surface.")
      .field("other", &S::other, "Its id in the other map.")
      .field("id", &S::id, "The surface here that has most of its points; 0: none has any.")
      .field("inliers", &S::inliers, "Points that it had there.")
      .field("shared", &S::shared, "Of them, in voxels of surface `id` here.")
      .field("on_surfaces", &S::on_surfaces, "Of them, in voxels of any surface here.");
  using R = MergeReport;
  Value<R>(module, "MergeReport", "What a merger did.")
      .field("changes", &R::changes, "ScanReport; points_raw: those of the other map.")
      .field("surfaces", &R::surfaces, "Each of the other map's: list of MergedSurface, ascending id there.")
      .text([](const R& report) {
        return "<MergeReport: " + std::to_string(report.changes.appeared) + " voxels appeared, " +
               std::to_string(report.changes.vanished) + " vanished, " +
               std::to_string(report.surfaces.size()) + " surfaces taken in>";
      });
}

void bind_map_alignment(py::module_& module) {
  using M = MapAlignment;
  Value<M>(module, "MapAlignment", "Where another map lies in the frame of a map.")
      .field("T_map_other", &M::T_map_other,
             "(4, 4) float64, the other map's frame to this one's; as given unless scan.outcome is "
             "\"corrected\"; a copy.")
      .field("scan", &M::scan, "Alignment of the other map's points as one scan.");
  constexpr AlignmentReach reach;
  module.def(
      "align_maps",
      [](const std::shared_ptr<Snapshot>& map, const MapPtr& other, const Eigen::Isometry3d& T_map_other,
         double translation_m, double rotation_rad) {
        return other->read([&](const Map& theirs) {
          return align_maps(map, theirs, T_map_other, {translation_m, rotation_rad});
        });
      },
      py::arg("map"), py::arg("other"),
      py::arg_v("T_map_other", Eigen::Isometry3d(Eigen::Isometry3d::Identity()), "numpy.eye(4)"),
      py::kw_only(), py::arg("translation_m") = reach.translation_m,
      py::arg("rotation_rad") = reach.rotation_rad,
      R"(MapAlignment of another Map with a Snapshot's surfaces, from a guess so far off at most: m, rad.

For Mapper.merge(). Throws Error(data) if the pose is not rigid.)");
}

constexpr const char* mapper_doc = R"(Keeps a map and its surfaces up to date, scan by scan.

1. Same scans and parameters, same map, byte for byte, whatever `threads` is.
2. All or nothing: whatever is raised, Error or MemoryError, the map is what it was before the call, and goes on.
3. snapshot() may be called from any thread at any time and never waits for an insertion.
4. While a scan is inserted, other Python threads run; a second insertion waits for the first.)";

}  // namespace

void bind_mapper(py::module_& module) {
  bind_report(module);
  bind_merge_report(module);
  bind_map_alignment(module);
  py::class_<PythonMapper> mapper(module, "Mapper", mapper_doc);
  mapper
      .def(py::init([](MapPtr map, int threads) {
             return std::make_unique<PythonMapper>(std::move(map), threads);
           }),
           py::arg("map"), py::arg("threads") = 1, "Goes on with a Map that has no Mapper yet.")
      .def(py::init([](const std::optional<Parameters>& parameters, int threads, const py::kwargs& given) {
             const Parameters all = parameters_of(parameters, given);
             return std::make_unique<PythonMapper>(std::make_shared<MapHolder>(Map(all)), threads);
           }),
           py::arg("parameters") = py::none(), py::arg("threads") = 1,
           R"(Begins an empty map: Mapper(), Mapper(resolution=0.02, up=None), Mapper(parameters).

What is given by name, as Parameters() takes it, wins over `parameters`. `threads` in [1, 256] share a scan's points and
rays. Throws Error(usage).)")
      .def("__repr__",
           [](const PythonMapper& self) {
             const std::shared_ptr<Snapshot> last = self.map()->snapshot();
             return "<Mapper at revision " + std::to_string(last->revision) + ": " +
                    std::to_string(last->surfaces.size()) + " surfaces>";
           })
      .def(
          "remember_scans", &PythonMapper::remember_scans,
          "From now on the map remembers which scans it takes, see Map.holds(): 8 bytes each, saved with it.")
      .def("insert", &PythonMapper::insert, py::arg("scan"),
           R"(Inserts a Scan and returns its ScanReport; nothing is copied.

Throws Error(data), and leaves the map as it was, if the pose is not rigid or outside the octree. A scan that is clearly off
and not to be put right is not inserted: report.alignment.outcome is "set_aside".)")
      .def(
          "insert_all", &PythonMapper::insert_all, py::arg("scans"),
          R"(Inserts Scans that have come while others were mapped, and returns a ScanReport for each that was taken.

The octree takes one after the other, the surfaces are brought up to date once: ten cost little more than two. Stops before a
scan that insert() would refuse; if that is the first, throws its Error(data), and leaves the map as it was. The scans are copied.)")
      .def("insert_points", &PythonMapper::insert_points, py::arg("points"), py::arg("T_map_sensor"),
           py::kw_only(), py::arg("stamp_s") = 0.0, py::arg("sensor") = SensorKind::depth_camera,
           py::arg("name") = "",
           "Scan(points, T_map_sensor, …) inserted: points (..., 3), m, sensor frame, copied; pose (4, 4).")
      .def("insert_depth", &PythonMapper::insert_depth, py::arg("depth"), py::arg("intrinsics"),
           py::arg("T_map_camera"), py::kw_only(), py::arg("depth_scale") = 1000.0, py::arg("stamp_s") = 0.0,
           py::arg("name") = "",
           "Scan.from_depth(depth, intrinsics, T_map_camera, …) inserted: an image (H, W), uint16 units or "
           "metres.")
      .def(
          "drain", &PythonMapper::drain,
          R"(Looks for surfaces in all that waits because scans had brought more than Parameters.detection.detection_budget.

After the last scan, and whenever there is time. Without effect if nothing waits. Returns a ScanReport.)")
      .def("detect_in_occupancy", &PythonMapper::detect_in_occupancy,
           "Surfaces of an occupancy map without scans (map_from_octomap()): a ScanReport.")
      .def("merge", &PythonMapper::merge, py::arg("other"),
           py::arg_v("T_map_other", Eigen::Isometry3d(Eigen::Isometry3d::Identity()), "numpy.eye(4)"),
           R"(Takes in another Map, which stays as it is: a MergeReport.

T_map_other, (4, 4), is the other map's frame in this one's, right to about a voxel (align_maps()); with the identity
nothing is resampled. Log-odds add up, so the maps must not share scans; surfaces that are here keep their ids.
Throws Error(data), and leaves the map as it was, if the maps' resolution, clamps or threshold of occupancy differ, or
the pose is not rigid. Some 10 µs a point of the other map.)")
      .def(
          "share_octree", &PythonMapper::share_octree, py::arg("on") = true,
          "From now on snapshots have an octree of the same scan; costs a camera's scan some tenths of a ms.")
      .def(
          "snapshot", [](const PythonMapper& self) { return self.map()->snapshot(); },
          "Snapshot of the last whole scan; shared, nothing is copied.")
      .def("map", &PythonMapper::map, "The Map that it keeps up to date; shared, not copied.");
}

}  // namespace octosurf::python
