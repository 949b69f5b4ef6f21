// octosurf/gaps.hpp in Python.
#include "bind.hpp"
#include "map_up.hpp"
#include "values.hpp"

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/gaps.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

constexpr double any_width = std::numeric_limits<double>::infinity();

std::pair<std::shared_ptr<Surface>, std::vector<Gap>> gaps_of(const std::shared_ptr<Surface>& surface,
                                                              const OccupancyView& octree,
                                                              double widest_bridged_m) {
  GroundedSurface found;
  {
    const py::gil_scoped_release others_run;
    found = find_gaps(*surface, octree, widest_bridged_m);
  }
  return {of_map(std::move(found.surface), map_up(surface)), std::move(found.gaps)};
}

std::shared_ptr<Snapshot> snapshot_with_gaps(const std::shared_ptr<Snapshot>& snapshot,
                                             const OccupancyView& octree, double widest_bridged_m) {
  std::shared_ptr<const Snapshot> grounded;
  {
    const py::gil_scoped_release others_run;
    grounded = with_gaps(*snapshot, octree, widest_bridged_m);
  }
  return of_map(std::move(grounded), map_up(snapshot));
}

py::dict shares_under(const std::shared_ptr<Surface>& surface, const OccupancyView& octree,
                      const ContactShape& shape, const Eigen::Isometry3d& T_map_contact) {
  const auto shares = ground_under(*surface, octree, shape, T_map_contact);
  py::dict named;
  for (std::size_t kind = 0; kind < shares.size(); ++kind)
    named[py::str(std::string(ground_names[kind]))] = shares[kind];
  return named;
}

}  // namespace

void bind_gaps(py::module_& module) {
  Value<Gap>(module, "Gap", "A place within a surface without readings of it.")
      .field("kind", &Gap::kind, R"("void", "blocked" or "unseen".)")
      .field("bridged", &Gap::bridged, "Unseen, and part of the surface: the readings' spacing explains it.")
      .field("width_m", &Gap::width_m, "m, diameter of the largest disc in it, to a voxel.")
      .field("outline", &Gap::outline, "Polygon, surface frame, m.");
  module.def("find_gaps", &gaps_of, py::arg("surface"), py::arg("octree"),
             py::arg("widest_bridged_m") = any_width,
             R"((Surface, list of Gap): a surface whose outline follows the reasons of its gaps.

octree: OccupancyView of the same scan. Mapping outlines a surface by its readings alone and closes gaps below
max_hole_size; here voids are holes however narrow, and unseen gaps up to widest_bridged_m, at most 1 m, are closed where the
readings' spacing explains them (octosurf/gaps.hpp). Some 0.5 us for each voxel of its extent.)");
  module.def("with_gaps", &snapshot_with_gaps, py::arg("snapshot"), py::arg("octree"),
             py::arg("widest_bridged_m") = any_width,
             "Snapshot whose surfaces are as find_gaps() has them; ids and revisions unchanged. What contact "
             "regions and plans are to be made of.");
  module.def("widest_unseen_of", &widest_unseen_of, py::arg("shape"), py::arg("share") = 0.25,
             "m: the widest unseen gap that a ContactShape may span, a share of its narrower side.");
  module.def(
      "ground_at",
      [](const std::shared_ptr<Surface>& surface, const OccupancyView& octree, const Eigen::Vector2d& uv) {
        return ground_at(*surface, octree, uv);
      },
      py::arg("surface"), py::arg("octree"), py::arg("uv"),
      R"(What is known of a place, (2,), surface frame, m: "supported", "void", "blocked" or "unseen".)");
  module.def("ground_under", &shares_under, py::arg("surface"), py::arg("octree"), py::arg("shape"),
             py::arg("T_map_contact"),
             "Dict of the shares of a ContactShape's area over each kind of ground, which sum to 1.");
}

}  // namespace octosurf::python
