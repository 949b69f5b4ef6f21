// octosurf/contact.hpp and gaps.hpp in Python: contact regions, footholds, convex pieces, gaps.
#include "map_holder.hpp"

#include <octosurf/contact.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/ground_patch.hpp>
#include <octosurf/pieces.hpp>
#include <octosurf/storeys.hpp>
#include <octosurf/up.hpp>

namespace octosurf::python {
namespace {

using SurfacePointer = std::shared_ptr<Surface>;

/// Without limits of its own a contact keeps the default ones, where up is the map's.
ContactLimits limits_on(const SurfacePointer& surface, const std::optional<ContactLimits>& given) {
  if (given) return *given;
  ContactLimits limits;
  limits.up = up_in(surface, {});
  return limits;
}

template <class T>
const T* pointer_to(const std::optional<T>& one) {
  return one ? &*one : nullptr;
}

void bind_shape_and_limits(Module& module) {
  const auto polygon = [](const py::object& outline, double radius) {
    ContactShape shape{{}, radius};
    rows_from(outline, shape.outline);
    return shape;
  };
  Value<ContactShape>(module, "ContactShape")
      .fields(OCTOSURF_FIELDS(ContactShape, outline, radius))
      .def("reach", &ContactShape::reach)
      .def_static("rectangle", &ContactShape::rectangle, "length"_a, "width"_a, "behind"_a = py::none())
      .def_static("disc", &ContactShape::disc, "radius"_a)
      .def_static(
          "polygon", [polygon](const Dense<double>& outline) { return polygon(outline, 0); }, "outline"_a,
          "(N, 2), m, convex, counter-clockwise, at least three vertices.")
      .def_static(
          "from_dict",
          [polygon](const py::dict& values) {
            return polygon(values["outline"], values["radius"].cast<double>());
          },
          "values"_a, "Back from to_dict().");
  using L = ContactLimits;
  Settings<L>(module, "ContactLimits")
      .fields(OCTOSURF_FIELDS(L, up, max_slope_rad, min_area_m2, max_rms_m, max_normal_std_rad,
                              max_offset_std_m, edge_margin_m, obstacle_margin_m, obstacle_from_m,
                              clearance_m, unknown_to_m));
}

void bind_gaps(Module& module) {
  Value<Gap>(module, "Gap").fields(OCTOSURF_FIELDS(Gap, kind, bridged, width_m, outline));
  module.def("widest_unseen_of", &widest_unseen_of, "shape"_a, "share"_a = 0.25);
}

/// A view of numbers of a patch or a storey, which lives as long as the array does.
template <class Number, class T, class Part>
auto part_view(const std::vector<Part> T::*part) {
  return [part](const py::object& owner) {
    const std::vector<Part>& values = owner.cast<const T&>().*part;
    return py::array_t<Number>({values.size()}, {sizeof(Number)},
                               reinterpret_cast<const Number*>(values.data()), owner);
  };
}

void bind_patch(Module& module) {
  using L = PatchLayout;
  Class<L>(module, "PatchLayout")
      .def(py::init([](const py::object& points, double max_step_m, double headroom_m, bool fill) {
             L layout{{}, max_step_m, headroom_m, fill};
             rows_from(points, layout.points);
             return layout;
           }),
           "points"_a, "max_step_m"_a = L().max_step_m, "headroom_m"_a = L().headroom_m, "fill"_a = false,
           "points: (N, 2), x forward and y to the left of the base, m.")
      .def_static(
          "grid",
          [](double length_m, double width_m, double cell_m, const std::optional<Eigen::Vector2d>& center) {
            return L::grid(length_m, width_m, cell_m, center.value_or(Eigen::Vector2d(0, 0)));
          },
          "length_m"_a = 1.6, "width_m"_a = 1.0, "cell_m"_a = 0.05, "center"_a = py::none())
      .def_property_readonly(
          "points", [](const py::object& self) { return view_of(self.cast<const L&>().points, self); },
          "(N, 2), m; a view.")
      .def_readwrite("max_step_m", &L::max_step_m, doc_of("PatchLayout.max_step_m"))
      .def_readwrite("headroom_m", &L::headroom_m, doc_of("PatchLayout.headroom_m"))
      .def_readwrite("fill", &L::fill, doc_of("PatchLayout.fill"));
  using P = GroundPatch;
  Class<P>(module, "GroundPatch")
      .def_property_readonly("height", part_view<float>(&P::height), "(N,) float32, m; a view.")
      .def_property_readonly("cell", part_view<std::uint8_t>(&P::cell),
                             "(N,) uint8: 0 unseen, 1 supported, 2 occupied, 3 below; a view.")
      .def_property_readonly("slope_rad", part_view<float>(&P::slope_rad), "(N,) float32; a view.")
      .def_property_readonly("edge_m", part_view<float>(&P::edge_m), "(N,) float32, m; a view.");
}

/// With the up of the map that its snapshots are of.
struct MapGround : GroundView {
  MapGround(GroundView view, std::shared_ptr<const MapUp> map)
      : GroundView(std::move(view)), up(std::move(map)) {}

  std::shared_ptr<const MapUp> up;

  SnapshotPtr of(std::shared_ptr<const Snapshot> snapshot) const { return of_map(std::move(snapshot), up); }
};

/// The grids' frame is upright by the view's rules.
StoreyLimits limits_for(const MapGround& ground, std::optional<StoreyLimits> given) {
  StoreyLimits limits = given.value_or(StoreyLimits{});
  limits.turn = upright(ground.rules().limits.up);
  return limits;
}

void bind_storeys(Module& module) {
  using L = StoreyLimits;
  Settings<L>(module, "StoreyLimits")
      .fields(OCTOSURF_FIELDS(L, radius_m, headroom_m, max_step_m, cell_m, min_area_m2))
      .def_static("of", &L::of, "robot"_a);
  Value<Storey>(module, "Storey")
      .fields(OCTOSURF_FIELDS(Storey, cell_m, origin, columns, rows, height_m, area_m2, surfaces, seams))
      .field("cells", part_view<std::uint8_t>(&Storey::cells),
             "(rows * columns,) uint8: 0 unknown, 1 free, 2 occupied; a view.")
      .field("elevation", part_view<float>(&Storey::elevation), "Likewise float32, m; a view.")
      .def("center_of", &Storey::center_of, "cell"_a)
      .def("cell_at", &Storey::cell_at, "point"_a);
  Value<RouteNode>(module, "RouteNode").fields(OCTOSURF_FIELDS(RouteNode, place, storey, at));
  using E = RouteEdge;
  Value<E>(module, "RouteEdge")
      .field(
          "from_", [](const E& edge) { return edge.from; }, "Index of a node.")
      .fields(OCTOSURF_FIELDS(E, to, length_m, stair, up, heading_rad, over_stair));
  Value<StoreyRoute>(module, "StoreyRoute")
      .fields(OCTOSURF_FIELDS(StoreyRoute, nodes, edges, without_landing));
  module.def(
      "find_storeys",
      [](const MapGround& ground, const std::optional<L>& limits) {
        return find_storeys(ground, limits_for(ground, limits));
      },
      "view"_a, "limits"_a = py::none(), Released());
  module.def(
      "find_route",
      [](const MapGround& ground, const std::vector<Storey>& storeys, const std::optional<L>& limits) {
        return find_route(ground, storeys, limits_for(ground, limits));
      },
      "view"_a, "storeys"_a, "limits"_a = py::none(), Released());
}

}  // namespace

void bind_contact(Module& module) {
  bind_shape_and_limits(module);
  Value<ContactRegion>(module, "ContactRegion")
      .fields(OCTOSURF_FIELDS(ContactRegion, surface, revision, yaw_rad, polygons, area_m2, refused));
  Value<Foothold>(module, "Foothold")
      .fields(OCTOSURF_FIELDS(Foothold, surface, T_map_contact, supported, margin_m, accepted, refused));
  module.def(
      "heading_on",
      [](const SurfacePointer& surface, double yaw_rad, const std::optional<Eigen::Vector3d>& up) {
        return heading_on(*surface, yaw_rad, up_in(surface, up));
      },
      "surface"_a, "yaw_rad"_a, "up"_a = py::none());
  module.def(
      "contact_region",
      [](const SurfacePointer& surface, const ContactShape& shape, std::optional<double> yaw_rad,
         const std::optional<ContactLimits>& limits, const std::optional<OccupancyView>& octree,
         const std::optional<SnapshotPtr>& others) {
        return contact_region(*surface, shape, yaw_rad, limits_on(surface, limits), pointer_to(octree),
                              others ? others->get() : nullptr);
      },
      "surface"_a, "shape"_a, "yaw_rad"_a = py::none(), "limits"_a = py::none(), py::kw_only(),
      "octree"_a = py::none(), "others"_a = py::none(), Released(),
      R"(ContactRegion of a Surface for one heading, rad counter-clockwise from the map's x axis, or None for all.

limits: None: ContactLimits() with up as Surface.slope_rad() has it.
octree: OccupancyView, asked for obstacles, clearance and gaps.
others: Snapshot of the octree's scan; what stands there is then where its surfaces' planes are, not all over their voxels.
Safe: a contact at any point of it lies on the surface. Throws Error(usage) for limits that make no sense or miss what they
need.)");
  module.def(
      "foothold",
      [](const SurfacePointer& surface, const ContactShape& shape, const Eigen::Vector3d& at, double yaw_rad,
         const std::optional<ContactLimits>& limits, const std::optional<OccupancyView>& octree,
         const std::optional<SnapshotPtr>& others) {
        return foothold(*surface, shape, at, yaw_rad, limits_on(surface, limits), pointer_to(octree),
                        others ? others->get() : nullptr);
      },
      "surface"_a, "shape"_a, "at"_a, "yaw_rad"_a, "limits"_a = py::none(), py::kw_only(),
      "octree"_a = py::none(), "others"_a = py::none(), Released());
  module.def("convex_pieces", &convex_pieces, "surface"_a, "polygons"_a, "most"_a = 20, "min_area_m2"_a = 0.0,
             Released());
  bind_gaps(module);
}

void bind_ground(Module& module) {
  bind_patch(module);
  using R = GroundRules;
  using G = MapGround;
  const auto patch_of = [](const G& ground, const Eigen::Isometry3d& T_map_base,
                           const std::optional<PatchLayout>& layout) {
    return ground_patch(ground, T_map_base, layout.value_or(PatchLayout::grid()));
  };
  Settings<R>(module, "GroundRules")
      .fields(OCTOSURF_FIELDS(R, foot, limits, widest_unseen_m, as_mapped))
      .def_static("of", &R::of, "robot"_a, "resolution"_a);
  Class<G>(module, "GroundView", "What of a Snapshot a robot may stand on: octosurf/ground.hpp.")
      .def(py::init([](const SnapshotPtr& snapshot, const OccupancyView& octree, std::optional<R> rules) {
             if (!rules) {
               rules = R::of(Biped{}, octree.resolution());
               rules->limits.up = up_in(snapshot, {});
             }
             return G(GroundView(snapshot, octree, *rules), map_up(snapshot));
           }),
           "snapshot"_a, "octree"_a, "rules"_a = py::none(),
           "rules: None: a biped's, with up as the map has it.")
      .def(
          "by", [](const G& ground, const R& rules) { return G(ground.by(rules), ground.up); }, "rules"_a)
      .def(
          "next",
          [](const G& ground, const SnapshotPtr& snapshot, const OccupancyView& octree) {
            return G(ground.next(snapshot, octree), map_up(snapshot));
          },
          "snapshot"_a, "octree"_a, Released())
      .def_property_readonly(
          "rules", [](const G& ground) { return ground.rules(); }, "Its GroundRules; a copy.")
      .def("stairs", &G::stairs, Released())
      .def(
          "solid", [](const G& ground) { return ground.of(ground.solid()); }, Released(),
          "Snapshot without voids and wide unseen gaps.")
      .def(
          "supported", [](const G& ground) { return ground.of(ground.supported()); }, Released(),
          "Snapshot of where a point contact may be.")
      .def(
          "gaps", [](const G& ground, SurfaceId id) { return ground.gaps(id); }, "id"_a, Released(),
          "List of Gap of a surface.")
      .def("ground_at", &G::ground_at, "id"_a, "at"_a, Released(), "Ground of a place on a surface's plane.")
      .def(
          "ground_under",
          [](const G& ground, SurfaceId id, const Eigen::Isometry3d& T_map_contact) {
            return by_name(ground.ground_under(id, T_map_contact), ground_names);
          },
          "id"_a, "T_map_contact"_a)
      .def("region", &G::region, "id"_a, "yaw_rad"_a = py::none(), Released())
      .def("region_about", &G::region_about, "id"_a, "about"_a, "reach_m"_a, "yaw_rad"_a = py::none(),
           Released(), "Of region() what lies within reach_m of a place.")
      .def("foothold", &G::foothold, "id"_a, "at"_a, "yaw_rad"_a, Released())
      .def("patch", patch_of, "T_map_base"_a, "layout"_a = py::none(), Released(), "ground_patch() of it.");
  module.def("ground_patch", patch_of, "ground"_a, "T_map_base"_a, "layout"_a = py::none(), Released());
  bind_storeys(module);
}

}  // namespace octosurf::python
