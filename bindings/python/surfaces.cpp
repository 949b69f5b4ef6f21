// octosurf/surface.hpp, cylinder.hpp and removals.hpp in Python.
#include "io/exporters/export_formats.hpp"
#include "io/text_file.hpp"
#include "map_holder.hpp"

#include <algorithm>
#include <set>

#include <octosurf/pieces.hpp>
#include <octosurf/removals.hpp>
#include <octosurf/surface.hpp>
#include <octosurf/up.hpp>

namespace octosurf::python {
namespace {

using SurfacePointer = std::shared_ptr<Surface>;  // of a map, see of_map()

void bind_plain_parts(Module& module) {
  Value<Plane>(module, "Plane")
      .fields(OCTOSURF_FIELDS(Plane, normal, offset))
      .def(py::init<const Eigen::Vector3d&, double>(), "normal"_a, "offset"_a,
           "A plane of a unit normal, (3,).")
      .def("signed_distance", &Plane::signed_distance, "point"_a);
  Value<Polygon>(module, "Polygon").fields(OCTOSURF_FIELDS(Polygon, outer, holes));
  Value<Mesh>(module, "Mesh").fields(OCTOSURF_FIELDS(Mesh, vertices, triangles));
  Value<ConvexPiece>(module, "ConvexPiece").fields(OCTOSURF_FIELDS(ConvexPiece, vertices, A, b));
  Value<Cylinder, std::shared_ptr<Cylinder>>(module, "Cylinder")
      .fields(OCTOSURF_FIELDS(Cylinder, id, axis_point, axis, radius_m, length_m, start, span_rad, inliers,
                              rms_m, born, revision));
}

py::array_t<double> to_map(const Surface& surface, const Dense<double>& uv) {
  if (uv.ndim() < 1 || uv.shape(uv.ndim() - 1) != 2)
    throw Error(Error::Kind::usage, "uv", "has shape " + std::string(py::str(uv.attr("shape"))),
                "give u, v in the last dimension");
  std::vector<py::ssize_t> shape(uv.shape(), uv.shape() + uv.ndim());
  shape.back() = 3;
  py::array_t<double> points(shape);
  double* to = points.mutable_data();
  for (const double* from = uv.data(); from != uv.data() + uv.size(); from += 2, to += 3)
    Eigen::Vector3d::Map(to) = surface.to_map({from[0], from[1]});
  return points;
}

std::string text_of_surface(const Surface& surface) {
  const Eigen::Vector3d& n = surface.plane.normal;
  return io::formatted("<Surface %ju: %.3f m², normal (%.3f, %.3f, %.3f), offset %.3f m>", surface.id,
                       surface.area_m2, n.x(), n.y(), n.z(), surface.plane.offset);
}

void bind_surface(Module& module) {
  Value<Surface, SurfacePointer>(
      module, "Surface",
      "One contact surface as a planner sees it. Immutable; lives as long as anything of it is held.")
      .fields(OCTOSURF_FIELDS(Surface, id, resolution, color, plane, T_map_surface, polygons, boundary,
                              area_m2, inliers, rms_m, covariance, born, revision, parents))
      .text(&text_of_surface)
      .def("normal_std_rad", &Surface::normal_std_rad)
      .def("offset_std_m", &Surface::offset_std_m)
      .def("to_map", &to_map, "uv"_a,
           "(..., 3) float64, map frame, of points (u, v) of its own, (..., 2), m; a row for each.")
      .def(
          "slope_rad",
          [](const SurfacePointer& self, const std::optional<Eigen::Vector3d>& up) {
            return slope_rad(*self, up_in(self, up));
          },
          "up"_a = py::none(),
          R"(Angle between normal and up, rad: 0 a floor, pi/2 a wall.

up: (3,), map frame; None: what the map's parameters give. Throws Error(usage) where they leave it open: give snapshot.up().)")
      .def("simplified", &simplified, Released(), doc_of("simplified"))
      .def(
          "mesh", [](const Surface& self) { return io::flat(self, simplified(self)); }, Released(),
          "Mesh of simplified(), map frame.")
      .def("extrude", &extrude, "thickness"_a, Released(), doc_of("extrude"));
}

template <class T>
std::vector<std::shared_ptr<T>> shared(const std::vector<std::shared_ptr<const T>>& all,
                                       const SnapshotPtr& snapshot) {
  std::vector<std::shared_ptr<T>> given;
  given.reserve(all.size());
  for (const auto& one : all) given.push_back(of_map(one, map_up(snapshot)));
  return given;
}

std::vector<Removal> removals(const Snapshot& snapshot, std::uint64_t since) {
  std::vector<Removal> gone;
  snapshot.removals.for_each_since(since, [&gone](const Removal& one) { gone.push_back(one); });
  return gone;
}

void bind_snapshot(Module& module) {
  Value<Removal>(module, "Removal").fields(OCTOSURF_FIELDS(Removal, of, id, into, born, revision, parents));
  Class<Snapshot, SnapshotPtr>(module, "Snapshot")
      .def(
          "up", [](const SnapshotPtr& self) { return up_in(self); },
          R"((3,) float64, unit: up in its map, as the parameters give it or, where they leave it open, estimated.

The estimate is up_of(map)'s, made anew each time: O(n^2) in surfaces, a few ns each.)")
      .def(
          "find",
          [](const SnapshotPtr& self, SurfaceId id) {
            const auto& all = self->surfaces;
            const auto at = std::ranges::lower_bound(all, id, {}, &Surface::id);
            return at != all.end() && (*at)->id == id ? of_map(*at, map_up(self)) : nullptr;
          },
          "id"_a, "The Surface of this id, or None.")
      .def(
          "only",
          [](const SnapshotPtr& self, const std::vector<SurfaceId>& given) {
            const std::set<SurfaceId> ids(given.begin(), given.end());
            auto part = std::make_shared<Snapshot>(*self);
            std::erase_if(part->surfaces, [&](const SurfacePtr& one) { return !ids.contains(one->id); });
            return of_map(std::shared_ptr<const Snapshot>(std::move(part)), map_up(self));
          },
          "ids"_a, "A Snapshot of these surfaces alone.")
      .def("removals", &removals, "since"_a = 0, "List of Removal after revision `since`, oldest first.")
      .def("__len__", [](const Snapshot& self) { return self.surfaces.size(); })
      .text([](const Snapshot& self) {
        return "<Snapshot at revision " + std::to_string(self.revision) + ": " +
               std::to_string(self.surfaces.size()) + " surfaces>";
      })
      .def_readonly("revision", &Snapshot::revision, doc_of("Snapshot.revision"))
      .def_readonly("resolution", &Snapshot::resolution, doc_of("Snapshot.resolution"))
      .def_readonly(
          "octree", &Snapshot::octree,
          "OccupancyView of the same scan; knows nothing unless Mapper.share_octree() was called before.")
      .def_property_readonly(
          "surfaces", [](const SnapshotPtr& self) { return shared(self->surfaces, self); },
          "List of Surface, ascending id.")
      .def_property_readonly(
          "cylinders", [](const SnapshotPtr& self) { return shared(self->cylinders, self); },
          "List of Cylinder, ascending id.");
}

}  // namespace

void bind_surfaces(Module& module) {
  bind_plain_parts(module);
  bind_surface(module);
  bind_snapshot(module);
}

}  // namespace octosurf::python
