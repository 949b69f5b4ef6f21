// octosurf/map.hpp, up.hpp and explain.hpp in Python.
#include "map_holder.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <span>

#ifdef OCTOSURF_PCL
#include <octosurf/adapters/paper_detector.hpp>
#endif
#include <octosurf/explain.hpp>
#include <octosurf/map.hpp>
#include <octosurf/up.hpp>

namespace octosurf::python {
namespace {

namespace fs = std::filesystem;

/// A row of Map.points().
struct PointRow {
  std::array<double, 3> point, view;
  float log_odds;
  SurfaceId surface;
};

std::array<double, 3> numbers_of(const Eigen::Vector3d& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

py::array_t<PointRow> points_of(const MapHolder& map) {
  return moved_array(map.read([](const Map& whole) {
    std::vector<PointRow> rows;
    whole.for_each_point([&rows](const OccupancyView::Voxel& voxel) {
      rows.push_back({numbers_of(voxel.point), numbers_of(voxel.view), voxel.log_odds, voxel.surface});
    });
    return rows;
  }));
}

std::string text_of_map(const MapHolder& map) {
  const Map::Size size = under_lock(&Map::size)(map);
  return "<Map: " + std::to_string(size.scans) + " scans, " + std::to_string(size.points) + " points, " +
         std::to_string(size.surfaces) + " surfaces>";
}

/// Problems that did not prevent loading or saving become Python warnings.
void warn(const std::string& warning) {
  if (!warning.empty() && PyErr_WarnEx(PyExc_UserWarning, warning.c_str(), 1) != 0)
    throw py::error_already_set();
}

MapPtr load(const fs::path& stem) {
  LoadedMap loaded = [&stem] {
    const py::gil_scoped_release others_run;
    return load_map(stem);
  }();
  warn(loaded.warning);
  return std::make_shared<MapHolder>(std::move(loaded.map));
}

void bind_map(Module& module) {
  Class<MapHolder, MapPtr>(module, "Map",
                           R"(The persistent thing: octree, surfaces, pending points, parameters.

Given to a Mapper it goes on being readable; what one thread asks of it then waits for the scan that another one
inserts, but for snapshot(), which never waits.)")
      .def(py::init([](const std::optional<Parameters>& parameters, const py::kwargs& given) {
             return std::make_shared<MapHolder>(Map(parameters_of(parameters, given)));
           }),
           "parameters"_a = py::none(),
           "An empty map, Map(resolution=0.02); what is given by name wins over `parameters`. Throws "
           "Error(usage) for what is out of range.")
      .def("holds", under_lock(&Map::holds), "scan"_a)
      .text(&text_of_map)
      .def("parameters", under_lock(&Map::parameters), "A copy of its Parameters.")
      .def("snapshot", &MapHolder::snapshot, "Snapshot of the last whole scan; shared, nothing is copied.")
      .def("at", under_lock(&Map::at), "point"_a)
      .def("octree", under_lock(&Map::octree), "OccupancyView as it is now.")
      .def("points", &points_of,
           R"(The points of all occupied voxels, in key order; a structured array of its own.

Columns: "point" (3 float64, map frame, m), "view" (3 float64, unit, toward where it was seen from),
"log_odds" (float32), "surface" (uint64; 0: pending).)")
      .def("size", under_lock(&Map::size))
      .def("digest", under_lock(&digest_of), doc_of("digest_of"))
      .def_property_readonly("origin", under_lock(&Map::origin), doc_of("Map.origin"));
}

void bind_diagnosis(Module& module) {
  Value<Figure>(module, "Figure").fields(OCTOSURF_FIELDS(Figure, name, value, unit, at_least));
  Value<Explanation>(module, "Explanation")
      .fields(OCTOSURF_FIELDS(Explanation, reason, sentence, asked, looked_at, surface, cylinder, nearest,
                              nearest_distance, figures, around));
  module.def(
      "explain",
      [](const MapHolder& map, const Eigen::Vector3d& point) {
        return map.read([&point](const Map& whole) { return explain(whole, point, papers_detector()); });
      },
      "map"_a, "point"_a,
      "Explanation: why is there no surface at `point`, (3,), map frame, m? Throws Error(usage) if it is not "
      "finite.");
}

}  // namespace

const detection::Detector* papers_detector() {
#ifdef OCTOSURF_PCL
  return paper_detector();
#else
  return nullptr;
#endif
}

void MapHolder::note_up(const Map& map) {
  const surfaces::MapState& state = surfaces::state_of(map);
  const double scans = std::max(1.0, static_cast<double>(state.scans));
  auto up = std::make_shared<const MapUp>(MapUp{map.parameters().up, state.sensors_up / scans});
  const std::lock_guard alone(up_busy_);
  up_ = std::move(up);
}

SnapshotPtr MapHolder::snapshot() const {
  std::shared_ptr<const Snapshot> last = mapper_ ? mapper_->snapshot() : map_->snapshot();
  const std::lock_guard alone(up_busy_);
  return of_map(std::move(last), up_);
}

Parameters parameters_of(const std::optional<Parameters>& given, const py::kwargs& fields) {
  const py::object settings = py::cast(given.value_or(Parameters{}));
  return settings.attr("replaced")(**fields).cast<Parameters>();
}

Eigen::Vector3d up_in(const SnapshotPtr& snapshot, const std::optional<Eigen::Vector3d>& wanted) {
  if (wanted) return *wanted;
  const std::shared_ptr<const MapUp> map = map_up(snapshot);
  if (map && map->given) return *map->given;
  return estimate_up(*snapshot, map ? map->sensors_up : Eigen::Vector3d::Zero()).direction;
}

Eigen::Vector3d up_in(const std::shared_ptr<Surface>& surface, const std::optional<Eigen::Vector3d>& wanted) {
  if (wanted) return *wanted;
  const std::shared_ptr<const MapUp> map = map_up(surface);
  if (map && map->given) return *map->given;
  throw Error(Error::Kind::usage, "up", "is not known of surface " + std::to_string(surface->id) + " alone",
              "give up=snapshot.up(), of its map's snapshot");
}

void bind_maps(Module& module) {
  PYBIND11_NUMPY_DTYPE(PointRow, point, view, log_odds, surface);
  using Size = Map::Size;
  Value<Size>(module, "MapSize", nullptr, "Map.Size")
      .fields(
          OCTOSURF_FIELDS(Size, nodes, leaves, bytes, points, pending, surfaces, inliers, scans, revision));
  bind_map(module);
  Value<Up>(module, "Up").fields(OCTOSURF_FIELDS(Up, direction, source));
  module.def("up_of", under_lock(&up_of), "map"_a,
             "The Up that the map's parameters give or, where they leave it open, the one that its surfaces "
             "suggest.");

  // The headers' names, and those of earlier versions.
  for (const char* name : {"load_map", "load"})
    module.def(name, &load, "stem"_a,
               R"(The Map of `stem`.surfaces, such as octosurf.load_map("maps/office").

Throws Error(data) for damaged or foreign files; warns (UserWarning) where, say, the .bt beside it does not match.)");
  for (const char* name : {"save_map", "save"})
    module.def(
        name,
        [](const MapHolder& map, const fs::path& stem) {
          warn(map.read([&stem](const Map& whole) { return save_map(whole, stem); }));
        },
        "map"_a, "stem"_a,
        R"(Writes `stem`.surfaces (everything) and `stem`.bt (plain OctoMap) over a map that is there.

Whenever that fails, the files of before or the new ones are there. A .bt of somebody else's is kept beside it, and a
UserWarning says how it is called. A folder of scans (`octosurf map --keep-scans`) that the map had is not told in them:
it has not got what Python inserted. Throws Error(usage) if `stem` names a folder, Error(output), Error(incomplete).)");
  module.def("read_octomap_resolution", &read_octomap_resolution, "file"_a);
  module.def(
      "map_from_octomap",
      [](const fs::path& file, const Parameters& parameters) {
        return std::make_shared<MapHolder>(map_from_octomap(file, parameters));
      },
      "file"_a, "parameters"_a = Parameters{}, Released());
  module.def(
      "map_from_leaves",
      [](const py::array_t<OccupancyView::Leaf, py::array::c_style>& leaves, const Parameters& parameters) {
        const std::span<const OccupancyView::Leaf> all(leaves.data(),
                                                       static_cast<std::size_t>(leaves.size()));
        return std::make_shared<MapHolder>(map_from_leaves(all, parameters));
      },
      "leaves"_a, "parameters"_a = Parameters{});
  bind_diagnosis(module);
}

}  // namespace octosurf::python
