// IHMC's planar regions in their text form: PlanarRegionFileTools.java, as docs/formats.md §7 describes it.
#include "geometry/rings.hpp"
#include "geometry/symmetric.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/exporters/planner_pieces.hpp"
#include "io/new_file.hpp"
#include "io/new_folder.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/planner_formats.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

/// With its last digit, as readers of 64-bit floats get it back.
std::string coordinate_text(double value, std::int32_t id) {
  io::finite(value, "region " + std::to_string(id));
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::string numbers_text(std::initializer_list<double> values, std::int32_t id) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + coordinate_text(value, id);
  return text;
}

std::string header_line(const IhmcRegion& region, int index) {
  const Eigen::Vector3d origin = region.T_world_region.translation();
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(region.T_world_region.linear()));
  const Eigen::Vector3d axis = turn.axis();
  std::string sizes;
  for (const Ring2& polygon : region.polygons)
    sizes += (sizes.empty() ? "" : ", ") + std::to_string(polygon.size());
  return "regionId: " + std::to_string(region.id) + ", index: " + std::to_string(index) +
         ", origin: " + numbers_text({origin.x(), origin.y(), origin.z()}, region.id) +
         ", orientation: " + numbers_text({axis.x(), axis.y(), axis.z(), turn.angle()}, region.id) +
         ", concave hull size: " + std::to_string(region.hull.size()) +
         ", number of convex polygons: " + std::to_string(region.polygons.size()) + ", [" + sizes + "]\n";
}

void write_clockwise(Ring2 ring, std::int32_t id, std::ostream& out) {
  if (geometry::signed_area(ring) > 0) std::reverse(ring.begin(), ring.end());
  for (const Eigen::Vector2d& v : ring) out << numbers_text({v.x(), v.y()}, id) << '\n';
}

std::string file_name(std::int32_t id, int index) {
  return "region" + std::to_string(id) + "_" + std::to_string(index);
}

bool is_region_file(const std::string& name) { return name == "header.txt" || name.starts_with("region"); }

[[noreturn]] void refuse_regions(const std::string& where, const std::string& what) {
  throw Error(Error::Kind::data, where, what, "give a folder of IHMC's planar regions (header.txt)");
}

/// The words of a line of header.txt, in their order.
class HeaderReader {
 public:
  HeaderReader(const io::TextLine& line, const fs::path& file) : line_(line), file_(file) {}

  bool at(const std::string& word) const { return next_ < line_.words.size() && line_.words[next_] == word; }
  void expect(std::initializer_list<const char*> label) {
    for (const char* word : label) {
      if (!at(word)) fail(std::string("has no '") + word + "' where it should stand");
      ++next_;
    }
  }
  std::int32_t integer() {
    const std::string word = without_brackets();
    std::int32_t value = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || stop != word.data() + word.size())
      fail("'" + word.substr(0, 40) + "' is not an integer");
    return value;
  }
  std::size_t size() {
    const std::int32_t value = integer();
    if (value < 0) fail("a size is negative");
    return static_cast<std::size_t>(value);
  }
  double real() {
    const double value = io::number(without_brackets(), file_, line_.number);
    if (!std::isfinite(value)) fail("a number is not finite");
    return value;
  }
  Eigen::Vector3d vector() {
    const double x = real(), y = real(), z = real();
    return {x, y, z};
  }
  Eigen::Vector3d direction() {
    const Eigen::Vector3d v = vector();
    const double largest = v.cwiseAbs().maxCoeff();
    if (largest == 0) fail("a direction has no length");
    return (v / largest).normalized();  // the squares of very short ones would lose their digits
  }
  std::size_t words_left() const { return line_.words.size() - next_; }
  [[noreturn]] void fail(const std::string& what) const {
    refuse_regions(io::at_line(file_, line_.number), what);
  }

 private:
  std::string without_brackets() {
    if (next_ >= line_.words.size()) fail("ends too early");
    std::string word = line_.words[next_++];
    if (word.starts_with('[')) word.erase(0, 1);
    if (word.ends_with(']')) word.pop_back();
    return word;
  }
  const io::TextLine& line_;
  const fs::path& file_;
  std::size_t next_ = 0;
};

struct Header {
  IhmcRegion region;
  std::int32_t index = 0;
  std::size_t hull = 0;
  std::vector<std::size_t> polygons;
};

Header read_header(const io::TextLine& line, const fs::path& file) {
  HeaderReader in(line, file);
  Header header;
  in.expect({"regionId:"});
  header.region.id = in.integer();
  in.expect({"index:"});
  header.index = in.integer();
  in.expect({"origin:"});
  Eigen::Isometry3d& pose = header.region.T_world_region;
  pose.translation() = in.vector();
  if (in.at("normal:")) {  // version 1: turned the shortest way
    in.expect({"normal:"});
    pose.linear() = geometry::rotation_between(Eigen::Vector3d::UnitZ(), in.direction()).matrix();
  } else {
    in.expect({"orientation:"});
    const Eigen::Vector3d axis = in.direction();
    pose.linear() = Eigen::AngleAxisd(in.real(), axis).matrix();
  }
  in.expect({"concave", "hull", "size:"});
  header.hull = in.size();
  in.expect({"number", "of", "convex", "polygons:"});
  const std::size_t polygons = in.size();
  const bool none = polygons == 0 && (in.words_left() == 0 || (in.words_left() == 1 && in.at("[]")));
  if (!none && in.words_left() != polygons)
    in.fail("lists " + std::to_string(in.words_left()) + " convex polygons and announces " +
            std::to_string(polygons));
  for (std::size_t i = 0; i < polygons; ++i) {
    header.polygons.push_back(in.size());
    // Empty ones would also cost far more memory than their two bytes here.
    if (header.polygons.back() < 3) in.fail("lists a convex polygon of fewer than three vertices");
  }
  return header;
}

Ring2 read_ring(const std::vector<io::TextLine>& lines, std::size_t first, std::size_t size,
                const fs::path& file) {
  Ring2 ring;
  ring.reserve(size);
  for (std::size_t i = first; i < first + size; ++i) {
    const std::vector<double> xy = io::numbers(lines[i], file);
    if (xy.size() != 2 || !std::isfinite(xy[0] + xy[1]))
      refuse_regions(io::at_line(file, lines[i].number), "is not a vertex 'x, y'");
    ring.emplace_back(xy[0], xy[1]);
  }
  if (geometry::signed_area(ring) < 0) std::reverse(ring.begin(), ring.end());
  return ring;
}

IhmcRegion read_region(Header header, const fs::path& folder) {
  const fs::path file = folder / file_name(header.region.id, header.index);
  const std::vector<io::TextLine> lines = io::read_text(file);
  std::size_t announced = header.hull;
  for (const std::size_t size : header.polygons) announced += size;  // each below 2³¹, and of 64 KiB of text
  if (lines.size() != announced)
    refuse_regions(file.string(), "has " + std::to_string(lines.size()) + " vertices where header.txt says " +
                                      std::to_string(announced));
  header.region.hull = read_ring(lines, 0, header.hull, file);
  std::size_t next = header.hull;
  for (const std::size_t size : header.polygons) {
    header.region.polygons.push_back(read_ring(lines, next, size, file));
    next += size;
  }
  return std::move(header.region);
}

}  // namespace

std::vector<IhmcRegion> ihmc_regions(const PlannerSurface& surface) {
  std::vector<IhmcRegion> regions;
  for (const Polygon& polygon : surface.polygons)
    regions.push_back({static_cast<std::int32_t>(surface.id), surface.T_world_surface, polygon.outer, {}});
  const Eigen::Isometry3d T_surface_world = surface.T_world_surface.inverse();
  for (const ConvexPiece& piece : surface.pieces) {
    Ring2 ring;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector3d& vertex : piece.vertices) {
      ring.emplace_back((T_surface_world * vertex).head<2>());
      middle += ring.back() / static_cast<double>(piece.vertices.size());
    }
    const std::size_t at = io::polygon_with(surface.polygons, middle);
    if (at < regions.size()) regions[at].polygons.push_back(std::move(ring));
  }
  return regions;
}

void export_ihmc(const std::vector<IhmcRegion>& regions, const fs::path& folder, bool force) {
  if (regions.empty()) throw io::nothing_to_write(folder);
  io::NewFolder output(folder, force, is_region_file);
  std::map<std::int32_t, int> indices;
  std::string header;
  for (const IhmcRegion& region : regions) {
    const int index = ++indices[region.id];
    header += header_line(region, index);
    io::NewFile file(output.temporary() / file_name(region.id, index), false, io::NewFile::LeftOvers::leave);
    file.write([&](std::ostream& out) {
      write_clockwise(region.hull, region.id, out);
      for (const Ring2& polygon : region.polygons) write_clockwise(polygon, region.id, out);
    });
    file.commit();
  }
  io::NewFile file(output.temporary() / "header.txt", false, io::NewFile::LeftOvers::leave);
  file.write([&](std::ostream& out) { out << header; });
  file.commit();
  output.commit();
}

std::vector<IhmcRegion> read_ihmc(const fs::path& folder) {
  const fs::path file = folder / "header.txt";
  std::vector<IhmcRegion> regions;
  std::set<std::pair<std::int32_t, std::int32_t>> seen;
  for (const io::TextLine& line : io::read_text(file)) {
    Header header = read_header(line, file);
    // Short lines that name one large file again and again would take any amount of memory.
    if (!seen.insert({header.region.id, header.index}).second)
      refuse_regions(io::at_line(file, line.number),
                     "gives " + file_name(header.region.id, header.index) + " a second time");
    regions.push_back(read_region(std::move(header), folder));
  }
  return regions;
}

}  // namespace octosurf
