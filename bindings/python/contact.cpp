// octosurf/contact.hpp in Python: contact regions, footholds and convex pieces.
#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "map_up.hpp"

#include <memory>
#include <optional>
#include <vector>

#include <octosurf/contact.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

using Edges = std::vector<PolygonEdges>;

/// Without limits of its own a contact keeps the default ones, where up is the map's.
ContactLimits limits_on(const std::shared_ptr<Surface>& surface, const std::optional<ContactLimits>& given) {
  if (given) return *given;
  ContactLimits limits;
  limits.up = up_in(surface, {});
  return limits;
}

void bind_shape(py::module_& module) {
  Value<ContactShape>(module, "ContactShape", R"(What touches a surface: the sole of a foot, or a palm.

In the contact's own frame, m: its reference point is the origin, x forward, y left, z away from the surface.)")
      .rows("outline", &ContactShape::outline,
            "(N, 2) float64, m, counter-clockwise; empty: a disc; a read-only view.")
      .field("radius", &ContactShape::radius, "m, of a disc.")
      .def_static("rectangle", &ContactShape::rectangle, py::arg("length"), py::arg("width"),
                  py::arg("behind") = py::none(),
                  "A sole; its reference point is `behind` m in front of its heel, in its middle by default.")
      .def_static("disc", &ContactShape::disc, py::arg("radius"), "A ball foot, m.")
      .def_static(
          "polygon",
          [](const py::array_t<double, py::array::c_style | py::array::forcecast>& outline) {
            return ContactShape{rows_of<double, 2>(outline), 0};
          },
          py::arg("outline"), "(N, 2), m, convex, counter-clockwise, at least three vertices.")
      .def("reach", &ContactShape::reach, "m: the farthest that any part lies from the reference point.")
      .def_static(
          "from_dict",
          [](const py::dict& values) {
            return ContactShape{rows_of<double, 2>(values["outline"]), values["radius"].cast<double>()};
          },
          py::arg("values"), "Back from to_dict().");
}

void bind_limits(py::module_& module) {
  using L = ContactLimits;
  Settings<L>(module, "ContactLimits",
              "What a contact needs. The defaults ask nothing but slope and support.")
      .field("up", &L::up, "(3,) float64, map frame, any length; Snapshot.up() is a map's; a view.")
      .field("max_slope_rad", &L::max_slope_rad, "rad, of the surface; pi: any, walls and ceilings too.")
      .field("min_area_m2", &L::min_area_m2, "m2, of the surface.")
      .field("max_rms_m", &L::max_rms_m, "m, roughness; None: any.")
      .field("max_normal_std_rad", &L::max_normal_std_rad, "rad; None: any.")
      .field("max_offset_std_m", &L::max_offset_std_m, "m; None: any.")
      .field("edge_margin_m", &L::edge_margin_m,
             "m between the contact and every edge; outlines reach up to d beyond what is there.")
      .field("frontier_margin_m", &L::frontier_margin_m, "m between the contact and edges of kind frontier.")
      .field("obstacle_margin_m", &L::obstacle_margin_m,
             "m between the contact and what is occupied above the surface; 0: not asked; needs a clearance.")
      .field("obstacle_from_m", &L::obstacle_from_m, "m above the plane from which voxels are obstacles.")
      .field("clearance_m", &L::clearance_m,
             "m along the normal with nothing over the contact; 0: not asked.")
      .field("gap_depth_m", &L::gap_depth_m,
             "m of free space under the contact that make a gap, refused as support; 0: not asked.");
}

void bind_results(py::module_& module) {
  using R = ContactRegion;
  Value<R>(module, "ContactRegion",
           "Where on one surface a contact's reference point may be so that every limit is kept.")
      .field("surface", &R::surface, "Id.")
      .field("revision", &R::revision, "Of the surface it was made from.")
      .field("yaw_rad", &R::yaw_rad, "rad; None: any heading will do there.")
      .field("polygons", &R::polygons, "List of Polygon, surface frame, m.")
      .field("area_m2", &R::area_m2, "m2.")
      .field(
          "refused", &R::refused,
          R"(If there is no polygon: the limits that leave nothing: "slope", "size", "roughness", "uncertainty",
"support", "margin", "frontier", "obstacle", "clearance".)");
  using F = Foothold;
  Value<F>(module, "Foothold", "One contact at a place, and what is to be said about it.")
      .field("surface", &F::surface, "Id.")
      .field("T_map_contact", &F::T_map_contact, "(4, 4) float64, on the plane, z along its normal; a copy.")
      .field("supported", &F::supported, "Share of the contact's area that lies on the surface, [0, 1].")
      .field("margin_m", &F::margin_m, "m to the nearest edge; negative: how much is beyond it.")
      .field("accepted", &F::accepted, "Every limit is kept.")
      .field("refused", &F::refused, "The first limit that is not, or None.");
}

}  // namespace

void bind_contact(py::module_& module) {
  bind_shape(module);
  bind_limits(module);
  bind_results(module);
  module.def(
      "heading_on",
      [](const std::shared_ptr<Surface>& surface, double yaw_rad, const std::optional<Eigen::Vector3d>& up) {
        return heading_on(*surface, yaw_rad, up_in(surface, up));
      },
      py::arg("surface"), py::arg("yaw_rad"), py::arg("up") = py::none(),
      "(2,) float64: where a contact's x axis points in the surface's frame, for a heading about `up`, rad; "
      "None: as Surface.slope_rad() has it.");
  module.def(
      "contact_region",
      [](const std::shared_ptr<Surface>& surface, ContactShape shape, std::optional<double> yaw_rad,
         std::optional<ContactLimits> limits, std::optional<OccupancyView> octree, std::optional<Edges> edges,
         const std::optional<std::shared_ptr<Snapshot>>& others) {
        const ContactLimits kept = limits_on(surface, limits);
        const py::gil_scoped_release others_run;
        return contact_region(*surface, shape, yaw_rad, kept, octree ? &*octree : nullptr,
                              edges ? &*edges : nullptr, others ? others->get() : nullptr);
      },
      py::arg("surface"), py::arg("shape"), py::arg("yaw_rad") = py::none(), py::arg("limits") = py::none(),
      py::kw_only(), py::arg("octree") = py::none(), py::arg("edges") = py::none(),
      py::arg("others") = py::none(),
      R"(ContactRegion of a Surface for one heading, rad counter-clockwise from the map's x axis, or None for all.

limits: None: ContactLimits() with up as Surface.slope_rad() has it.
octree: OccupancyView, asked for obstacles, clearance and gaps. edges: label_edges() of the surface, for a frontier margin.
others: Snapshot of the octree's scan; what stands there is then where its surfaces' planes are, not all over their voxels.
Safe: a contact at any point of it lies on the surface. Throws Error(usage) for limits that make no sense or miss what they
need.)");
  module.def(
      "foothold",
      [](const std::shared_ptr<Surface>& surface, ContactShape shape, const Eigen::Vector3d& at,
         double yaw_rad, std::optional<ContactLimits> limits, std::optional<OccupancyView> octree,
         std::optional<Edges> edges, const std::optional<std::shared_ptr<Snapshot>>& others) {
        const ContactLimits kept = limits_on(surface, limits);
        const py::gil_scoped_release others_run;
        return foothold(*surface, shape, at, yaw_rad, kept, octree ? &*octree : nullptr,
                        edges ? &*edges : nullptr, others ? others->get() : nullptr);
      },
      py::arg("surface"), py::arg("shape"), py::arg("at"), py::arg("yaw_rad"), py::arg("limits") = py::none(),
      py::kw_only(), py::arg("octree") = py::none(), py::arg("edges") = py::none(),
      py::arg("others") = py::none(),
      "Foothold: judges a contact whose reference point stands at `at`, (3,), map frame, projected onto the "
      "plane.");
  module.def(
      "convex_pieces",
      [](const std::shared_ptr<Surface>& surface, const ContactRegion& region, std::size_t most,
         double min_area_m2) {
        const py::gil_scoped_release others_run;
        return convex_pieces(*surface, region, most, min_area_m2);
      },
      py::arg("surface"), py::arg("region"), py::arg("most"), py::arg("min_area_m2") = 0.0,
      R"(At most `most` disjoint convex pieces inside a ContactRegion, the largest first: a list of ConvexPiece.

They cover as much of it as they can. Surface.convex_pieces() covers all of a surface's polygons instead.)");
}

}  // namespace octosurf::python
