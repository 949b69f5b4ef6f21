#include "diagnosis/refusal_text.hpp"

#include <locale>
#include <sstream>

namespace octosurf {
namespace {

template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(3);
  (out << ... << parts);
  return out.str();
}

/// Fewer than n points do something; `what` they do.
StatedReason too_few(const Refused& refused, const std::string& what) {
  return {Reason::too_few_points,
          text("No surface: only ", refused.measured, " points ", what, ", and a surface needs ",
               refused.limit, "."),
          {{"points", refused.measured, "", refused.limit, {}}},
          0};
}

}  // namespace

StatedReason reason_for(const Refused& refused) {
  const double measured = refused.measured, limit = refused.limit;
  const SurfaceId surface = refused.surface;
  switch (refused.why) {
    case Refusal::isolated:
      return {Reason::isolated,
              "No surface: the point here stands alone, with fewer than two others within r.",
              {},
              0};
    case Refusal::seen_through:
      return {Reason::seen_through,
              text("No surface: what was seen here was seen through surface ", surface, " and is its noise."),
              {},
              surface};
    case Refusal::small_region:
      return too_few(refused, "hang together smoothly here");
    case Refusal::no_plane:
      return {Reason::too_few_points, "No surface: the points here lie in a line.", {}, 0};
    case Refusal::few_on_plane:
      return too_few(refused, "of the patch here lie on one plane");
    case Refusal::small_cluster:
      return too_few(refused, "on the plane here lie less than h apart");
    case Refusal::few_left:
      return too_few(refused, "are left here beside the planes found");
    case Refusal::narrow:
      return {Reason::too_narrow,
              text("No surface: the patch here is ", measured, " m wide, and a surface needs ", limit, " m."),
              {{"width", measured, "m", limit, {}}},
              0};
    case Refusal::bent:
      return {Reason::bent, "No surface: the patch here is curved, like a pillar's side.", {}, 0};
    case Refusal::scattered:
      return {Reason::scattered,
              text("No surface: the points here scatter about their plane by ", measured,
                   " times the noise, and a surface may by ", limit, "."),
              {{"scatter", measured, "", {}, limit}},
              0};
    case Refusal::few_for_range:
      return {Reason::too_few_for_range,
              text("No surface: ", measured,
                   " points seen from so far prove nothing yet; with that noise it needs ", limit, "."),
              {{"points", measured, "", limit, {}}},
              0};
    case Refusal::normals_disagree:
      return {Reason::normals_disagree,
              text("No surface: the plane through the points here agrees with the normals of ",
                   100 * measured, " % of them, and a surface needs more than ", 100 * limit, " %."),
              {{"agreeing", measured, "", limit, {}}},
              0};
    case Refusal::noise_sheet:
      return {Reason::noise_sheet,
              text("No surface: the patch here is parallel to surface ", surface, " and within its noise."),
              {},
              surface};
  }
  return {};
}

StatedReason reason_for(const Unsound& dissolved) {
  const auto as = [&](Refusal why) {
    return reason_for(Refused{why, {}, dissolved.measured, dissolved.limit, dissolved.neighbour});
  };
  switch (dissolved.why) {
    case Unsound::Why::few:
      return as(Refusal::few_on_plane);
    case Unsound::Why::narrow:
      return as(Refusal::narrow);
    case Unsound::Why::bent:
      return as(Refusal::bent);
    case Unsound::Why::sheet:
      return as(Refusal::noise_sheet);
  }
  return {};
}

StatedReason on_cylinder(CylinderId cylinder) {
  return {Reason::on_cylinder, text("No surface: this is on cylinder ", cylinder, "."), {}, 0, cylinder};
}

StatedReason not_flat(double curvature, double limit) {
  return {Reason::not_flat,
          text("No surface: the surroundings of the point here are not flat (curvature ", curvature,
               ", at most ", limit, "): an edge, something round, or clutter."),
          {{"curvature", curvature, "", {}, limit}},
          0};
}

StatedReason no_normal() {
  return {Reason::no_normal,
          "No surface: the point here has too few neighbours for a normal, or all in a line.",
          {},
          0};
}

StatedReason waiting(double accumulated, double n) {
  return {Reason::waiting,
          text("Not yet a surface: detection would make one here, but only looks once enough new points have "
               "come (",
               accumulated, " of ", n, " are waiting)."),
          {{"new_points", accumulated, "", n, {}}},
          0};
}

std::string sentence_of(Reason reason, SurfaceId surface) {
  switch (reason) {
    case Reason::on_surface:
      return text("There is a surface here: surface ", surface, ".");
    case Reason::in_hole:
      return text("No surface: this is in a hole of surface ", surface, ".");
    case Reason::beside_surface:
      return text("No surface: the nearest point belongs to surface ", surface,
                  ", and this is outside its polygons.");
    case Reason::outside_map:
      return "No surface: this is outside what the octree can hold.";
    case Reason::unseen:
      return "No surface: nothing was ever seen here.";
    case Reason::free_space:
      return "No surface: this is free space.";
    case Reason::no_point:
      return "No surface: the voxel here is occupied, but no scan has put a point into it.";
    default:
      return {};
  }
}

}  // namespace octosurf
