#include "geometry/degrees.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/new_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>
#include <unistd.h>

#include <octosurf/planner_formats.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* route_file = "route.geojson";

/// As map_server reads it: the first row has the largest y.
void write_pgm(const Storey& storey, std::ostream& out) {
  constexpr std::array<char, 3> shades{static_cast<char>(205), static_cast<char>(254), 0};  // by StoreyCell
  out << "P5\n" << storey.columns << ' ' << storey.rows << "\n255\n";
  for (std::size_t row = storey.rows; row-- > 0;)
    for (std::size_t column = 0; column < storey.columns; ++column)
      out.put(shades.at(static_cast<std::size_t>(storey.cells[row * storey.columns + column])));
}

void write_yaml(const Storey& storey, const std::string& name, std::ostream& out) {
  // map_server takes what is darker than 1 - free_thresh for not free: unknown, 205, is 0.19608.
  const Eigen::Vector3d origin = io::tidy({storey.origin.x(), storey.origin.y(), 0});
  out << "image: " << name << ".pgm\nmode: trinary\nresolution: " << Json(storey.cell_m) << "\norigin: ["
      << Json(origin.x()) << ", " << Json(origin.y())
      << ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
}

/// Numbers of files that people read: to 0.1 mm, and with a point, because nav2_route tells integers apart.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

Json coordinates(const Eigen::Vector3d& at) {
  return {rounded(io::finite(at.x(), route_file)), rounded(io::finite(at.y(), route_file))};
}

Json feature(const char* type, Json coordinates, Json properties) {
  return {{"type", "Feature"},
          {"properties", std::move(properties)},
          {"geometry", {{"type", type}, {"coordinates", std::move(coordinates)}}}};
}

Json node_feature(const RouteNode& node, std::size_t id, const std::string& frame) {
  return feature("Point", coordinates(node.at),
                 {{"id", id},
                  {"frame", frame},
                  {"metadata",
                   {{"class", route_place_names.at(static_cast<std::size_t>(node.place))},
                    {"storey", node.storey},
                    {"height_m", rounded(node.at.z())}}}});
}

Json metadata_of(const RouteEdge& edge, const StoreyRoute& route, const std::vector<Stair>& stairs) {
  const RouteNode &from = route.nodes.at(edge.from), &to = route.nodes.at(edge.to);
  if (!edge.stair) return {{"class", "floor"}, {"from_storey", from.storey}, {"to_storey", to.storey}};
  const Stair& stair = stairs.at(*edge.stair);
  return {{"class", "stair"},
          {"stair", stair.id},
          {"kind", stair_kind_names.at(static_cast<std::size_t>(stair.kind))},
          {"direction", edge.up ? "up" : "down"},
          {"risers", stair.steps.size()},
          {"riser_m", rounded(stair.riser.mean_m)},
          {"tread_m", rounded(stair.tread.mean_m)},
          {"width_m", rounded(stair.width_m)},
          {"heading_deg", rounded(edge.heading_rad * deg_per_rad)},
          {"rise_m", rounded(to.at.z() - from.at.z())},
          {"from_storey", from.storey},
          {"to_storey", to.storey}};
}

Json edge_feature(const RouteEdge& edge, std::size_t id, const StoreyRoute& route,
                  const std::vector<Stair>& stairs, const std::string& stair_operation) {
  Json line = Json::array({coordinates(route.nodes.at(edge.from).at)});
  for (const Eigen::Vector3d& at : edge.over_stair) line.push_back(coordinates(at));
  line.push_back(coordinates(route.nodes.at(edge.to).at));
  Json properties{{"id", id},
                  {"startid", edge.from},
                  {"endid", edge.to},
                  {"cost", rounded(edge.length_m)},
                  {"overridable", true},
                  {"metadata", metadata_of(edge, route, stairs)}};
  if (edge.stair && !stair_operation.empty())
    for (const auto& [name, trigger] : {std::pair{"enter_stair", "ON_ENTER"}, {"leave_stair", "ON_EXIT"}})
      properties["operations"][name] = {
          {"type", stair_operation}, {"trigger", trigger}, {"metadata", properties["metadata"]}};
  return feature("MultiLineString", Json::array({std::move(line)}), std::move(properties));
}

void write_route(const StoreyRoute& route, const std::vector<Stair>& stairs, const std::string& frame,
                 const std::string& stair_operation, std::ostream& out) {
  out << R"({"type": "FeatureCollection", "name": "octosurf", "features": [)";
  const char* separator = "\n";
  for (std::size_t i = 0; i < route.nodes.size(); ++i, separator = ",\n")
    out << separator << node_feature(route.nodes[i], i, frame);
  // Ids of edges go on behind those of nodes: what closes one must not close the other.
  for (std::size_t i = 0; i < route.edges.size(); ++i)
    out << separator << edge_feature(route.edges[i], route.nodes.size() + i, route, stairs, stair_operation);
  out << "\n]}\n";
}

bool is_ours(const fs::path& file) {
  const std::string name = file.filename().string(), ending = file.extension().string();
  return name == route_file || (name.starts_with("storey_") && (ending == ".pgm" || ending == ".yaml"));
}

void require_replaceable(const fs::path& folder, bool force) {
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder))
    throw Error(Error::Kind::usage, folder.string(), "is a file", "name a folder");
  for (const fs::directory_entry& file : fs::directory_iterator(folder)) {
    if (!is_ours(file.path()))
      throw Error(Error::Kind::usage, folder.string(),
                  "holds " + file.path().filename().string() + ", which is no grid or route",
                  "name another folder");
    if (!force) throw Error(Error::Kind::usage, folder.string(), "exists", "--force replaces it");
  }
}

/// Beside the folder that it is to become; removed with all in it if it has not.
class PartFolder {
 public:
  explicit PartFolder(const fs::path& whole) : path(whole.string() + ".part-" + std::to_string(::getpid())) {
    fs::create_directory(path);
  }
  PartFolder(const PartFolder&) = delete;
  PartFolder& operator=(const PartFolder&) = delete;
  ~PartFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }

  const fs::path path;
};

/// Renames `part` to `folder`. What was there goes, or is back if that fails.
void replace(const fs::path& folder, const fs::path& part) {
  const fs::path before = part.string() + "-old";
  const bool replaces = fs::exists(folder);
  if (replaces) fs::rename(folder, before);
  std::error_code failure;
  fs::rename(part, folder, failure);
  if (failure && replaces) fs::rename(before, folder);
  if (failure) throw fs::filesystem_error("rename", part, folder, failure);
  fs::remove_all(before);
}

}  // namespace

void export_nav2(const std::vector<Storey>& storeys, const StoreyRoute& route,
                 const std::vector<Stair>& stairs, const std::string& frame, const fs::path& to, bool force,
                 const std::string& stair_operation) {
  const fs::path folder = to.has_filename() ? to : to.parent_path();
  if (storeys.empty()) throw io::nothing_to_write(folder);
  try {
    require_replaceable(folder, force);
    const PartFolder part(folder);
    for (std::size_t i = 0; i < storeys.size(); ++i) {
      const std::string name = "storey_" + std::to_string(i);
      io::write_file(part.path / (name + ".pgm"), false,
                     [&](std::ostream& out) { write_pgm(storeys[i], out); });
      io::write_file(part.path / (name + ".yaml"), false,
                     [&](std::ostream& out) { write_yaml(storeys[i], name, out); });
    }
    if (!route.edges.empty())
      io::write_file(part.path / route_file, false,
                     [&](std::ostream& out) { write_route(route, stairs, frame, stair_operation, out); });
    replace(folder, part.path);
  } catch (const fs::filesystem_error& error) {
    throw Error(Error::Kind::output, folder.string(), "cannot be written: " + error.code().message());
  }
}

}  // namespace octosurf
