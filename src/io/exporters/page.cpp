#include "geometry/directions.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/exporters/page_messages.hpp"
#include "io/exporters/page_template.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>
#include <sstream>
#include <tuple>
#include <utility>
#include <zlib.h>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

using Json = io::PageBlock::Json;

std::string gzip(std::string_view bytes) {
  constexpr int gzip_format = 16;
  constexpr std::size_t most = std::size_t{2} << 30;
  if (bytes.size() > most)
    throw Error(Error::Kind::output, "page", "takes more than 2 GB", "export parts of the map");
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS + gzip_format, MAX_MEM_LEVEL,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string result(deflateBound(&stream, bytes.size()), '\0');
  // zlib only reads it, but older declarations lack the const.
  stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  deflate(&stream, Z_FINISH);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  return result;
}

std::string base64(std::string_view bytes) {
  using namespace boost::archive::iterators;
  using Digits = base64_from_binary<transform_width<const char*, 6, 8>>;
  std::string text(Digits(bytes.data()), Digits(bytes.data() + bytes.size()));
  return text.append((4 - text.size() % 4) % 4, '=');
}

std::string script(const std::string& message) {
  return "<script type=\"application/octet-stream\" class=\"map\">" + base64(message) + "</script>\n";
}

void check_page(const PageMap& map, const PageOptions& options) {
  if (io::page_template().empty())
    throw Error(
        Error::Kind::usage, map.name, "this octosurf was built without the page",
        "install Node.js and npm, run ./dev build (or npm ci in web/ and build anew); --png draws a picture");
  if (!(std::isfinite(options.max_mb) && options.max_mb > 0))
    throw Error(Error::Kind::usage, "max_mb", "is not positive", "10 is the default");
  geometry::require_direction(options.up, "up");
}

/// As octosurf export writes .json.
std::string export_text(const PageMap& map, const Snapshot& snapshot) {
  ExportOptions options;
  if (!map.stairs.empty()) options.stairs = Stairs{map.stairs, {}};
  const io::ExportJob job{snapshot, options, false};
  std::ostringstream out;
  io::write_json(job, out);
  return std::move(out).str();
}

Json successors_json(const std::vector<MapChanges::Successor>& all, const char* now) {
  Json list = Json::array();
  for (const MapChanges::Successor& one : all) list.push_back({{"id", one.before}, {now, one.now}});
  return list;
}

/// An occupied voxel, or several merged to a larger one.
struct PageVoxel {
  std::array<int, 3> zyx{};  ///< its corner over its edge
  float log_odds = 0;
  SurfaceId surface = 0;
};

/// All occupied voxels, by z, then y, then x.
std::vector<PageVoxel> occupied_voxels(const OccupancyView& octree) {
  std::vector<PageVoxel> voxels;
  const double d = octree.resolution();
  if (d == 0) return voxels;
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  octree.for_each_occupied({-far, far}, [&](const OccupancyView::Voxel& voxel) {
    const Eigen::Vector3i at = (voxel.center / d).array().floor().cast<int>();
    voxels.push_back({{at.z(), at.y(), at.x()}, voxel.log_odds, voxel.surface});
    return true;
  });
  std::ranges::sort(voxels, {}, &PageVoxel::zyx);
  return voxels;
}

/// Of each cube of 2³ voxels the one with the highest log-odds, as large as the cube.
void merge_voxels(std::vector<PageVoxel>& voxels) {
  for (PageVoxel& voxel : voxels)
    for (int& key : voxel.zyx) key >>= 1;  // rounds down
  std::ranges::stable_sort(voxels, [](const PageVoxel& a, const PageVoxel& b) {
    return std::tuple(a.zyx, -a.log_odds) < std::tuple(b.zyx, -b.log_odds);
  });
  const auto [rest, end] = std::ranges::unique(voxels, {}, &PageVoxel::zyx);
  voxels.erase(rest, end);
}

/// Each number less the one before it, modulo 2¹⁶: small numbers compress well.
std::vector<std::uint16_t> differences(std::vector<std::uint16_t> numbers) {
  std::adjacent_difference(
      numbers.begin(), numbers.end(), numbers.begin(),
      [](std::uint16_t number, std::uint16_t before) { return static_cast<std::uint16_t>(number - before); });
  return numbers;
}

void add_voxels(io::PageBlock& block, const std::vector<PageVoxel>& voxels, double size) {
  if (voxels.empty()) return;
  PageVoxel low = voxels.front();
  float least = low.log_odds, greatest = low.log_odds;
  for (const PageVoxel& voxel : voxels) {
    for (std::size_t k = 0; k < 3; ++k) low.zyx[k] = std::min(low.zyx[k], voxel.zyx[k]);
    least = std::min(least, voxel.log_odds);
    greatest = std::max(greatest, voxel.log_odds);
  }
  constexpr float steps = std::numeric_limits<std::uint8_t>::max();
  const float step = greatest > least ? (greatest - least) / steps : 1;
  std::array<std::vector<std::uint16_t>, 3> places;
  std::vector<std::uint8_t> log_odds;
  std::vector<std::uint32_t> surfaces;
  for (const PageVoxel& voxel : voxels) {
    for (std::size_t k = 0; k < 3; ++k)  // an octree is 65536 voxels wide
      places[k].push_back(static_cast<std::uint16_t>(voxel.zyx[k] - low.zyx[k]));
    log_odds.push_back(static_cast<std::uint8_t>(std::lround((voxel.log_odds - least) / step)));
    surfaces.push_back(static_cast<std::uint32_t>(voxel.surface));  // its low 32 bits are its own
  }
  block.json["voxels"] = {{"size", size},
                          {"low", Json::array({low.zyx[2], low.zyx[1], low.zyx[0]})},
                          {"least_log_odds", least},
                          {"log_odds_step", step}};
  block.add("voxel_x", differences(places[2]));
  block.add("voxel_y", differences(places[1]));
  block.add("voxel_z", differences(places[0]));
  block.add("voxel_log_odds", log_odds);
  block.add("voxel_surface", surfaces);
}

}  // namespace

std::string io::PageBlock::document() const {
  // Invalid UTF-8 in a name is replaced.
  std::string document = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return document.insert(document.size() - 1, texts_);
}

std::string io::PageBlock::packed() const {
  std::string document = this->document();
  document.resize((document.size() + 3) / 4 * 4, ' ');
  const auto length = static_cast<std::uint32_t>(document.size());
  std::string whole(sizeof length, 0);
  std::memcpy(whole.data(), &length, sizeof length);
  whole += document;
  whole += bytes_;
  return gzip(whole);
}

io::PageBlock io::surfaces_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run,
                                   const std::optional<MapChanges>& since) {
  Snapshot sent = *map.snapshot;
  MapChanges changes = since.value_or(MapChanges{});
  if (since) {
    sent.surfaces = sent.changed_since(since->since);
    std::erase_if(sent.cylinders,
                  [&](const CylinderPtr& cylinder) { return cylinder->revision <= since->since; });
  }
  for (const auto& successor : changes.cylinders_merged) changes.cylinders_gone.push_back(successor.before);
  PageBlock block;
  block.json = {{"kind", "surfaces"},
                {"run", run},
                {"name", map.name},
                {"up", up.normalized()},
                {"since", since ? Json(since->since) : Json()},
                {"revision", sent.revision},
                {"appeared", changes.appeared},
                {"changed", changes.changed},
                {"gone", changes.gone},
                {"merged", successors_json(changes.merged, "into")},
                {"split", successors_json(changes.split, "part")},
                {"cylinders_gone", changes.cylinders_gone}};
  block.add("now", export_text(map, sent));
  return block;
}

std::string io::voxels_message(const PageMap& map, double most_bytes) {
  std::vector<PageVoxel> voxels = occupied_voxels(map.octree);
  const std::size_t before_merging = voxels.size();
  for (int merged = 1;; merged *= 2) {
    if (merged > 32) {
      merged = 0;
      voxels.clear();
    } else if (merged > 1) {
      merge_voxels(voxels);
    }
    PageBlock block;
    block.json["kind"] = "voxels";
    block.json["revision"] = map.snapshot->revision;
    block.json["merged"] = merged;
    block.json["voxels_before_merging"] = before_merging;
    add_voxels(block, voxels, map.octree.resolution() * merged);
    std::string message = block.packed();
    if (merged == 0 || static_cast<double>(message.size()) <= most_bytes) return message;
  }
}

std::string make_page(const PageMap& map, const PageOptions& options) {
  check_page(map, options);
  const std::string_view page = io::page_template();
  const std::size_t mark = page.find(io::page_map_mark);
  const std::string_view before = page.substr(0, mark), after = page.substr(mark + io::page_map_mark.size());
  const std::string surfaces = script(io::surfaces_message(map, options.up).packed());
  std::string voxels = script({});
  const auto left = [&] {
    return options.max_mb * 1e6 -
           static_cast<double>(before.size() + surfaces.size() + voxels.size() + after.size());
  };
  voxels = script(io::voxels_message(map, 0.75 * left()));  // base64 has 4 bytes for 3
  if (left() < 0)
    throw Error(
        Error::Kind::output, map.name, "makes a page larger than allowed even without voxels",
        io::formatted("allow %.1f MB (--max-mb)", std::ceil(10 * (options.max_mb - left() / 1e6)) / 10));
  return std::string(before).append(surfaces).append(voxels).append(after);
}

}  // namespace octosurf
