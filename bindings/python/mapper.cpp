// octosurf/mapper.hpp, alignment.hpp, map_alignment.hpp and judgement.hpp in Python.
#include "map_holder.hpp"

#include <octosurf/alignment.hpp>
#include <octosurf/judgement.hpp>
#include <octosurf/map_alignment.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/space_part.hpp>

namespace octosurf::python {
namespace {

/// Python's Mapper: the map it keeps up to date, and room for the points of the scan at hand.
struct PythonMapper {
  PythonMapper(MapPtr given, int threads) : map(std::move(given)) { map->take_over(threads); }

  ScanReport insert(const Scan& one) {
    return map->write([&one](Mapper& mapper) { return mapper.insert(one); });
  }

  /// Points are copied to where the scan's before lay: fresh memory would cost more than the copying does.
  ScanReport insert_points(const Points& points, const Eigen::Isometry3d& T_map_sensor, double stamp_s,
                           SensorKind sensor, std::string name) {
    require_shape(points);
    return map->write([&](Mapper& mapper) {
      copy_points(points, scan.points);
      scan.T_map_sensor = T_map_sensor;
      scan.stamp_s = stamp_s;
      scan.sensor = sensor;
      scan.name = std::move(name);
      return mapper.insert(scan);
    });
  }

  ScanReport insert_depth(const py::array& depth, const py::object& intrinsics,
                          const Eigen::Isometry3d& T_map_camera, double depth_scale, double stamp_s,
                          std::string name) {
    return insert(scan_of_depth(depth, intrinsics, T_map_camera, depth_scale, stamp_s, std::move(name)));
  }

  ScanReport merge(const MapPtr& other, const Eigen::Isometry3d& T_map_other) {
    if (other == map)
      throw Error(Error::Kind::usage, "other", "is the map itself, whose readings would count twice",
                  "give another one");
    return map->write_with(
        *other, [&](Mapper& mapper, const Map& theirs) { return mapper.merge(theirs, T_map_other); });
  }

  ScanReport replace_occupancy(const MapPtr& other) {
    if (other == map) return {};
    return map->write_with(
        *other, [](Mapper& mapper, const Map& theirs) { return mapper.replace_occupancy(theirs); });
  }

  std::string text() const {
    const SnapshotPtr last = map->snapshot();
    return "<Mapper at revision " + std::to_string(last->revision) + ": " +
           std::to_string(last->surfaces.size()) + " surfaces>";
  }

  MapPtr map;
  Scan scan;
};

void bind_alignment(Module& module) {
  using A = Alignment;
  Value<A>(module, "Alignment", R"(A scan's pose against the surfaces of a map.

Twists are (6,): three rotations (rad), then three translations (m), map axes, about the sensor's position.)")
      .fields(OCTOSURF_FIELDS(A, outcome, T_map_sensor, covariance, directions, determined, lever_m, samples,
                              known, explained, contradicted))
      .def("explained_share", &A::explained_share);
  Value<Whereabouts>(module, "Whereabouts", "Where in a map a run of scans was taken.")
      .fields(OCTOSURF_FIELDS(Whereabouts, finding, T_map_scans, places, margin, seen_rad));
  const AlignmentReach reach;
  using SharedLocalizer = Locked<Localizer>;
  Class<SharedLocalizer>(module, "Localizer")
      .def(
          py::init([](const MapHolder& map, double translation_m, double rotation_rad) {
            return map.read([&](const Map& finished) {
              return std::make_unique<SharedLocalizer>(finished, AlignmentReach{translation_m, rotation_rad});
            });
          }),
          "map"_a, py::kw_only(), "translation_m"_a = reach.translation_m,
          "rotation_rad"_a = reach.rotation_rad,
          "map: as it is now. Looks so far about a scan's pose: m, rad; turns beyond 0.5 about the vertical "
          "only.")
      .def(
          "localize",
          [](SharedLocalizer& self, const Scan& scan) {
            return self.use([&scan](Localizer& localizer) { return localizer(scan); });
          },
          "scan"_a,
          R"(Alignment of a Scan, whose T_map_sensor is a first guess.

Outcome "unexplained": it fits nowhere or at several places alike, or what it sees contradicts the map. Throws Error(data) if the pose is not rigid.)")
      .def(
          "find",
          [](SharedLocalizer& self, const std::vector<Scan>& scans, const std::optional<Eigen::Vector3d>& low,
             const std::optional<Eigen::Vector3d>& high, bool upright) {
            const Eigen::AlignedBox3d region =
                low && high ? Eigen::AlignedBox3d(*low, *high) : Eigen::AlignedBox3d();
            return self.use([&](Localizer& localizer) { return localizer.find(scans, region, upright); });
          },
          "scans"_a, "low"_a = py::none(), "high"_a = py::none(), py::kw_only(), "upright"_a = true);
}

/// What Python calls of a Mapper.
template <class Answer, class... Arguments>
auto changed(Answer (Mapper::*change)(Arguments...)) {
  return [change](const PythonMapper& self, Arguments... arguments) {
    return self.map->write([&](Mapper& mapper) { return (mapper.*change)(arguments...); });
  };
}

void bind_judgement(Module& module) {
  using J = Judgement;
  Value<J>(module, "Judgement")
      .fields(OCTOSURF_FIELDS(J, views, alone, sparse, pairs, contradicting, axis, axis_pairs,
                              axis_contradicting, outvoted, judged, worst, worst_places, worst_apart,
                              common_error, common_error_m, oddities, step_m, range_m, resolution_m))
      .def("contradicts", &J::contradicts)
      .def("describe", &J::describe);
  using Judge = Locked<RecordingJudge>;
  Class<Judge>(module, "RecordingJudge")
      .def(py::init<const Parameters&>(), "parameters"_a = Parameters())
      .def(
          "add",
          [](Judge& self, const Scan& scan, const Eigen::Isometry3d& T_map_sensor) {
            self.use([&](RecordingJudge& judge) { judge.add(scan, T_map_sensor); });
          },
          "scan"_a, "T_map_sensor"_a)
      .def("judge",
           [](Judge& self) { return self.use([](RecordingJudge& judge) { return judge.judge(); }); });
}

void bind_reports(Module& module) {
  using R = ScanReport;
  Value<R>(module, "ScanReport")
      .fields(OCTOSURF_FIELDS(R, points_raw, points_not_finite, points_too_near, points_beyond_range,
                              points_out_of_map, voxels, appeared, vanished, categorized, added, expanded,
                              detected, waiting, alignment, born, grown, shrunk, merged, gone))
      .field("stage_ms", &R::stage_ms, stage_names)
      .fields(OCTOSURF_FIELDS(R, total_ms))
      .text([](const R& report) {
        return "<ScanReport: " + std::to_string(report.points_raw) + " points, " +
               std::to_string(report.appeared) + " voxels appeared, " + std::to_string(report.vanished) +
               " vanished, " + std::to_string(report.born.size()) + " surfaces born>";
      });
}

py::arg_v no_motion() {
  return {"T_map_other", Eigen::Isometry3d(Eigen::Isometry3d::Identity()), "numpy.eye(4)"};
}

void bind_map_alignment(Module& module) {
  Value<MapAlignment>(module, "MapAlignment").fields(OCTOSURF_FIELDS(MapAlignment, T_map_other, scan));
  const AlignmentReach reach;
  module.def(
      "align_maps",
      [](const SnapshotPtr& map, const MapHolder& other, const Eigen::Isometry3d& T_map_other,
         double translation_m, double rotation_rad) {
        return other.read([&](const Map& theirs) {
          return align_maps(map, theirs, T_map_other, {translation_m, rotation_rad});
        });
      },
      "map"_a, "other"_a, no_motion(), py::kw_only(), "translation_m"_a = reach.translation_m,
      "rotation_rad"_a = reach.rotation_rad);
}

constexpr const char* mapper_doc = R"(Keeps a map and its surfaces up to date, scan by scan.

1. Same scans and parameters, same map, byte for byte, whatever `threads` is.
2. All or nothing: whatever is raised, Error or MemoryError, the map is what it was before the call, and goes on.
3. snapshot() may be called from any thread at any time and never waits for an insertion.
4. While a scan is inserted, other Python threads run; a second insertion waits for the first.)";

}  // namespace

void bind_mapper(Module& module) {
  bind_alignment(module);
  bind_reports(module);
  bind_map_alignment(module);
  bind_judgement(module);
  Value<SpacePart>(module, "SpacePart")
      .fields(OCTOSURF_FIELDS(SpacePart, T_map_part, half_size, round))
      .def(py::init([](const Eigen::Isometry3d& T_map_part, const Eigen::Vector3d& half_size, bool round) {
             return SpacePart{T_map_part, half_size, round};
           }),
           "T_map_part"_a, "half_size"_a, "round"_a = false)
      .def_static(
          "box",
          [](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
            return SpacePart::box({low, high});
          },
          "low"_a, "high"_a)
      .def_static(
          "cylinder",
          [](const Eigen::Vector3d& base, double radius, double height) {
            return SpacePart::cylinder(base, radius, height);
          },
          "base"_a, "radius"_a, "height"_a)
      .def("distance", &SpacePart::distance, "point"_a);
  Class<PreparedScan>(module, "PreparedScan")
      .def_property_readonly("scan", &PreparedScan::scan, doc_of("PreparedScan.scan"));
  using M = PythonMapper;
  Class<M>(module, "Mapper", mapper_doc)
      .def(py::init<MapPtr, int>(), "map"_a, "threads"_a = 1, "Goes on with a Map that has no Mapper yet.")
      .def(py::init([](const std::optional<Parameters>& parameters, int threads, const py::kwargs& given) {
             const Parameters all = parameters_of(parameters, given);
             return std::make_unique<M>(std::make_shared<MapHolder>(Map(all)), threads);
           }),
           "parameters"_a = py::none(), "threads"_a = 1,
           R"(Begins an empty map: Mapper(), Mapper(resolution=0.02, up=None), Mapper(parameters).

What is given by name, as Parameters() takes it, wins over `parameters`. `threads` in [1, 256] share a scan's points and
rays. Throws Error(usage).)")
      .text(&M::text)
      .def("remember_scans", changed(&Mapper::remember_scans))
      .def("insert", &M::insert, "scan"_a)
      .def(
          "insert",
          [](const M& self, const PreparedScan& prepared) {
            return self.map->write([&](Mapper& mapper) { return mapper.insert(prepared); });
          },
          "prepared"_a)
      .def(
          "prepare", [](const M& self, Scan scan) { return self.map->prepare(std::move(scan)); }, "scan"_a)
      .def(
          "insert_all",
          [](const M& self, const std::vector<Scan>& scans) {
            return self.map->write([&scans](Mapper& mapper) { return mapper.insert_all(scans); });
          },
          "scans"_a)
      .def("insert_points", &M::insert_points, "points"_a, "T_map_sensor"_a, py::kw_only(), "stamp_s"_a = 0.0,
           "sensor"_a = SensorKind::depth_camera, "name"_a = "",
           "Scan(points, T_map_sensor, …) inserted: points (..., 3), m, sensor frame, copied; pose (4, 4).")
      .def("insert_depth", &M::insert_depth, "depth"_a, "intrinsics"_a, "T_map_camera"_a, py::kw_only(),
           "depth_scale"_a = 1000.0, "stamp_s"_a = 0.0, "name"_a = "",
           "Scan.from_depth(depth, intrinsics, T_map_camera, …) inserted: an image (H, W), uint16 units or "
           "metres.")
      .def("drain", changed(&Mapper::drain))
      .def("detect_in_occupancy", changed(&Mapper::detect_in_occupancy))
      .def("replace_occupancy", &M::replace_occupancy, "other"_a)
      .def("merge", &M::merge, "other"_a, no_motion())
      .def("clear", changed(&Mapper::clear), "part"_a, "as_free"_a = false)
      .def("share_octree", changed(&Mapper::share_octree), "on"_a = true)
      .def(
          "snapshot", [](const M& self) { return self.map->snapshot(); }, Released(),
          "Snapshot of the last whole scan; shared, nothing is copied.")
      .def(
          "map", [](const M& self) { return self.map; },
          "The Map that it keeps up to date; shared, not copied.");
}

}  // namespace octosurf::python
