#include "evaluation/truth.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include <octosurf/error.hpp>

namespace octosurf::evaluation {
namespace {

using Json = nlohmann::json;

constexpr const char* format_name = "octosurf-truth";
constexpr int format_version = 1;
/// Cells further out than this are no scene but a damaged file; keeps readers' grids small.
constexpr int max_cell_index = 10'000'000;

/// A mesh's scene has the name of its file, which need not be UTF-8: odd bytes are replaced.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json ring_to_json(const Ring2& ring) {
  Json json = Json::array();
  for (const auto& p : ring) json.push_back({p.x(), p.y()});
  return json;
}

Json face_to_json(const TrueFace& face) {
  Json polygons = Json::array();
  for (const auto& polygon : face.polygons) {
    Json holes = Json::array();
    for (const auto& hole : polygon.holes) holes.push_back(ring_to_json(hole));
    polygons.push_back({{"outer", ring_to_json(polygon.outer)}, {"holes", holes}});
  }
  Json pose = Json::array();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) pose.push_back(face.T_map_face.matrix()(r, c));
  Json visible = Json::array();
  for (const auto& run : face.visible) visible.push_back({run.row, run.column, run.count});
  const auto& n = face.plane.normal;
  return {{"id", face.id},
          {"name", face.name},
          {"normal", {n.x(), n.y(), n.z()}},
          {"offset", face.plane.offset},
          {"T_map_face", pose},
          {"polygons", polygons},
          {"visible", visible},
          {"visible_area_m2", face.visible_area_m2},
          {"gone", face.gone}};
}

Json stair_to_json(const TrueStair& stair) {
  const auto point = [](const Eigen::Vector3d& at) { return Json{at.x(), at.y(), at.z()}; };
  Json edges = Json::array();
  for (const auto& [left, right] : stair.edges) edges.push_back({point(left), point(right)});
  return {{"kind", stair.kind}, {"riser_m", stair.riser_m}, {"tread_m", stair.tread_m}, {"edges", edges}};
}

/// What is wrong with the content, without the file's name; turned into an Error by load_truth.
struct Damage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

void require(bool condition, const std::string& what) {
  if (!condition) throw Damage(what);
}

double finite(const Json& json) {
  require(json.is_number(), "a number is missing");
  const auto value = json.get<double>();
  require(std::isfinite(value), "a number is not finite");
  return value;
}

int cell_index(const Json& json) {
  require(json.is_number_integer(), "a visible cell is not an integer");
  const auto value = json.get<std::int64_t>();
  require(std::abs(value) <= max_cell_index, "a visible cell lies outside any scene");
  return static_cast<int>(value);
}

Ring2 ring_from_json(const Json& json) {
  require(json.is_array() && json.size() >= 3, "a ring has fewer than three vertices");
  Ring2 ring;
  for (const auto& p : json) {
    require(p.is_array() && p.size() == 2, "a vertex is not a pair");
    ring.emplace_back(finite(p[0]), finite(p[1]));
  }
  return ring;
}

Eigen::Isometry3d pose_from_json(const Json& json) {
  require(json.is_array() && json.size() == 16, "T_map_face has not 16 numbers");
  Eigen::Isometry3d T;
  for (int i = 0; i < 16; ++i) T.matrix()(i / 4, i % 4) = finite(json[i]);
  const Eigen::Matrix3d R = T.linear();
  require((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
              R.determinant() > 0 && (T.matrix().row(3) - Eigen::RowVector4d(0, 0, 0, 1)).isZero(1e-9),
          "T_map_face is not a rigid motion");
  return T;
}

TrueFace face_from_json(const Json& json) {
  TrueFace face;
  const auto& id = json.at("id");
  require(id.is_number_unsigned() && id.get<std::uint64_t>() >= 1 &&
              id.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max(),
          "a face's id is not a positive integer");
  face.id = id.get<std::uint32_t>();
  face.name = json.at("name").get<std::string>();
  const auto& n = json.at("normal");
  require(n.is_array() && n.size() == 3, "a normal has not three numbers");
  face.plane.normal = {finite(n[0]), finite(n[1]), finite(n[2])};
  require(std::abs(face.plane.normal.norm() - 1) < 1e-6, "a normal is not of length 1");
  face.plane.offset = finite(json.at("offset"));
  face.T_map_face = pose_from_json(json.at("T_map_face"));
  for (const auto& polygon : json.at("polygons")) {
    Polygon& added = face.polygons.emplace_back();
    added.outer = ring_from_json(polygon.at("outer"));
    for (const auto& hole : polygon.at("holes")) added.holes.push_back(ring_from_json(hole));
  }
  for (const auto& run : json.at("visible")) {
    require(run.is_array() && run.size() == 3, "a run of visible cells is not a triple");
    face.visible.push_back({cell_index(run[0]), cell_index(run[1]), cell_index(run[2])});
    require(face.visible.back().count > 0, "a run of visible cells is empty");
  }
  face.visible_area_m2 = finite(json.at("visible_area_m2"));
  face.gone = json.at("gone").get<bool>();
  return face;
}

TrueStair stair_from_json(const Json& json) {
  TrueStair stair;
  stair.kind = json.at("kind").get<std::string>();
  stair.riser_m = finite(json.at("riser_m"));
  stair.tread_m = finite(json.at("tread_m"));
  for (const auto& edge : json.at("edges")) {
    require(edge.is_array() && edge.size() == 2, "a stair's edge has not two ends");
    auto& ends = stair.edges.emplace_back();
    for (std::size_t i = 0; i < 2; ++i) {
      require(edge[i].is_array() && edge[i].size() == 3, "an edge's end has not three numbers");
      ends[i] = {finite(edge[i][0]), finite(edge[i][1]), finite(edge[i][2])};
    }
  }
  require(!stair.edges.empty(), "a stair has no edge");
  return stair;
}

Truth truth_from_json(const Json& json) {
  require(json.is_object() && json.value("format", Json()) == format_name, "not a truth file");
  const auto& version = json.at("version");
  require(version == format_version, "version " + version.dump() + " is not known");
  Truth truth;
  truth.scene = json.at("scene").get<std::string>();
  truth.sensor = json.at("sensor").get<std::string>();
  require(json.at("seed").is_number_unsigned(), "the seed is not an unsigned integer");
  truth.seed = json.at("seed").get<std::uint64_t>();
  truth.cell = finite(json.at("cell"));
  require(truth.cell > 0, "the cell's edge is not positive");
  truth.visible_hits = cell_index(json.at("visible_hits"));
  require(truth.visible_hits >= 1, "visible_hits is below 1");
  require(json.at("faces").is_array(), "faces is not an array");
  std::set<std::uint32_t> ids;
  for (const auto& face : json.at("faces")) {
    truth.faces.push_back(face_from_json(face));
    require(ids.insert(truth.faces.back().id).second, "a face's id appears twice");
  }
  // Not in older files.
  if (json.contains("stairs"))
    for (const auto& stair : json.at("stairs")) truth.stairs.push_back(stair_from_json(stair));
  return truth;
}

}  // namespace

void save_truth(const Truth& truth, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  // One face a line: still one JSON document, yet a diff or a pager can cope with it.
  out << "{\"format\":" << Json(format_name) << ",\"version\":" << format_version
      << ",\"scene\":" << text_of(truth.scene) << ",\"sensor\":" << text_of(truth.sensor)
      << ",\"seed\":" << truth.seed << ",\"cell\":" << Json(truth.cell)
      << ",\"visible_hits\":" << truth.visible_hits << ",\"faces\":[";
  const char* separator = "\n";
  for (const auto& face : truth.faces) {
    out << separator << text_of(face_to_json(face));
    separator = ",\n";
  }
  out << "\n],\"stairs\":[";
  separator = "\n";
  for (const auto& stair : truth.stairs) {
    out << separator << text_of(stair_to_json(stair));
    separator = ",\n";
  }
  out << "\n]}\n";
  out.close();
  if (!out)
    throw Error(Error::Kind::output, file.string(), "cannot be written",
                "check that the folder exists and the disk has room");
}

Truth load_truth(const std::filesystem::path& file) {
  const auto error = [&](const std::string& what) {
    return Error(Error::Kind::data, file.string(), what, "give the truth.json that `simulate` wrote");
  };
  std::ifstream in(file, std::ios::binary);
  if (!in) throw error("cannot be read");
  try {
    return truth_from_json(Json::parse(in));
  } catch (const Json::parse_error& e) {
    throw error("is not JSON (damaged at byte " + std::to_string(e.byte) + ")");
  } catch (const Json::exception&) {
    throw error("a field of a truth file is missing or of another type");
  } catch (const std::ios_base::failure&) {
    throw error("cannot be read");  // e.g. a folder: opens, but fails at the first byte
  } catch (const Damage& e) {
    throw error(e.what());
  }
}

}  // namespace octosurf::evaluation
