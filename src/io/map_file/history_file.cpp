#include "io/map_file/history_file.hpp"

#include "history_file.pb.h"
#include "io/map_file/file_beginning.hpp"
#include "io/map_file/record_stream.hpp"
#include "io/new_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/history.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;
using history_file::Record;

constexpr io::FileBeginning beginning{io::history_file_magic, io::history_file_version, "a map's history",
                                      "octosurf map --history"};

// What a file may decompress to; poses and outlines of rooms shrink to a half.
constexpr io::Expansion history_stream{.free = std::uint64_t{4} << 20, .ratio = 12};
constexpr std::int64_t farthest_step = 20'000'000'000;  // 2·10⁶ m: beyond any octree

void write_past_ring(const Ring2& ring, std::array<std::int64_t, 2>& last, history_file::Surface& record) {
  for (const Eigen::Vector2d& at : ring)
    for (std::size_t k = 0; k < 2; ++k) {
      const std::int64_t step = std::llround(at[static_cast<Eigen::Index>(k)] / io::history_step_m);
      record.add_uv(step - last[k]);
      last[k] = step;
    }
  record.add_vertices(static_cast<std::uint32_t>(ring.size()));
}

void write_surface(const PastSurface& surface, history_file::Surface& record) {
  record.set_id(surface.id);
  record.set_born(surface.born);
  record.set_revision(surface.revision);
  for (const float part : surface.color) record.add_color(part);
  for (int i = 0; i < 12; ++i) record.add_pose(surface.T_map_surface(i / 4, i % 4));
  record.set_area(surface.area_m2);
  record.set_inliers(surface.inliers);
  std::array<std::int64_t, 2> last{};
  for (const Polygon& polygon : surface.polygons) {
    record.add_rings(static_cast<std::uint32_t>(1 + polygon.holes.size()));
    write_past_ring(polygon.outer, last, record);
    for (const Ring2& hole : polygon.holes) write_past_ring(hole, last, record);
  }
}

void write_cylinder(const Cylinder& cylinder, history_file::Cylinder& record) {
  record.set_id(cylinder.id);
  record.set_born(cylinder.born);
  record.set_revision(cylinder.revision);
  for (const double x : cylinder.axis_point) record.add_shape(x);
  for (const double x : cylinder.axis) record.add_shape(x);
  record.add_shape(cylinder.radius_m);
  record.add_shape(cylinder.length_m);
  for (const double x : cylinder.start) record.add_shape(x);
  record.add_shape(cylinder.span_rad);
  record.add_shape(cylinder.rms_m);
  record.set_inliers(cylinder.inliers);
}

void write_moment(const Moment* before, const Moment& now, history_file::Moment& record) {
  const MomentChanges changes = changes_of(before, now);
  record.set_revision(now.revision);
  record.set_stamp_s(now.stamp_s);
  for (const PastSurfacePtr& surface : changes.surfaces) write_surface(*surface, *record.add_surfaces());
  for (const SurfaceId id : changes.gone) record.add_gone(id);
  for (const CylinderPtr& cylinder : changes.cylinders) write_cylinder(*cylinder, *record.add_cylinders());
  for (const CylinderId id : changes.cylinders_gone) record.add_cylinders_gone(id);
}

class HistoryReader {
 public:
  explicit HistoryReader(const fs::path& file)
      : where_(file.string()),
        in_(file, std::ios::binary),
        records_((refuse_folders(), io::after_beginning(in_, where_, beginning)),
                 history_stream.most(size_of(file)), where_) {}

  History operator()() {
    const Record first = next();
    require(first.has_header() && first.header().stride() > 0 &&
                first.header().stride() < io::largest_count &&
                first.header().moments() <= History::most_moments,
            "its header makes no sense");
    std::vector<Moment> moments;
    for (std::uint64_t i = 0; i < first.header().moments(); ++i) {
      const Record record = next();
      require(record.has_moment(), "a moment is missing");
      read(record.moment(), moments);
    }
    const Record last = next();
    require(last.has_footer() && last.footer().has_crc32() &&
                last.footer().crc32() == records_.crc32_before_last(),
            "the checksum differs");
    require(!records_.next(bytes_), "records follow the last one");
    return History::of(std::move(moments), first.header().stride());
  }

 private:
  [[noreturn]] void fail(const char* what) const {
    throw Error(Error::Kind::data, where_, std::string("is damaged: ") + what, "restore it from a backup");
  }
  void require(bool holds, const char* what) const {
    if (!holds) fail(what);
  }

  static std::uint64_t size_of(const fs::path& file) {
    std::error_code failure;
    const std::uintmax_t bytes = fs::file_size(file, failure);
    return failure ? 0 : bytes;
  }

  void refuse_folders() const {
    std::error_code ignored;
    if (!in_ || fs::is_directory(where_, ignored))
      throw Error(Error::Kind::data, where_, "cannot be read", "octosurf map --history FILE writes one");
  }

  Record next() {
    Record record;
    require(records_.next(bytes_) && record.ParseFromString(bytes_),
            "a record is missing, or cannot be read");
    return record;
  }

  double finite(double value) const {
    require(std::isfinite(value), "a number is not finite");
    return value;
  }

  /// Those of the moment before with what has changed.
  void read(const history_file::Moment& record, std::vector<Moment>& moments) {
    Moment moment = moments.empty() ? Moment{} : moments.back();
    require(record.revision() < io::largest_count && (moments.empty() || record.revision() > moment.revision),
            "a moment is out of order");
    moment.revision = record.revision();
    moment.stamp_s = finite(record.stamp_s());
    drop(moment.surfaces, record.gone());
    drop(moment.cylinders, record.cylinders_gone());
    std::vector<PastSurfacePtr> surfaces;
    for (const history_file::Surface& one : record.surfaces())
      surfaces.push_back(surface(one, moment.revision));
    std::vector<CylinderPtr> cylinders;
    for (const history_file::Cylinder& one : record.cylinders())
      cylinders.push_back(cylinder(one, moment.revision));
    moment.surfaces = merged(moment.surfaces, surfaces);
    moment.cylinders = merged(moment.cylinders, cylinders);
    entries_ += moment.surfaces.size() + moment.cylinders.size();
    require(entries_ <= History::most_entries || moments.empty(), "it is larger than any history");
    moments.push_back(std::move(moment));
  }

  template <typename Pointer, typename Ids>
  void drop(std::vector<Pointer>& list, const Ids& ids) const {
    require(std::is_sorted(ids.begin(), ids.end()), "what went is out of order");
    const std::size_t before = list.size();
    std::erase_if(list,
                  [&](const Pointer& one) { return std::binary_search(ids.begin(), ids.end(), one->id); });
    require(before - list.size() == static_cast<std::size_t>(ids.size()),
            "something went that was not there");
  }

  template <typename Pointer>
  std::vector<Pointer> merged(const std::vector<Pointer>& before, const std::vector<Pointer>& now) const {
    for (std::size_t i = 0; i < now.size(); ++i)
      require(now[i]->id > (i == 0 ? 0 : now[i - 1]->id), "ids are out of order");
    std::vector<Pointer> all;
    std::set_union(now.begin(), now.end(), before.begin(), before.end(), std::back_inserter(all),
                   [](const Pointer& a, const Pointer& b) { return a->id < b->id; });
    return all;  // of two with one id, the first range's
  }

  PastSurfacePtr surface(const history_file::Surface& record, std::uint64_t latest) {
    require(record.color_size() == 3 && record.pose_size() == 12 && record.revision() <= latest &&
                record.born() <= latest,
            "a surface makes no sense");
    PastSurface surface;
    surface.id = record.id();
    surface.born = record.born();
    surface.revision = record.revision();
    for (int k = 0; k < 3; ++k)
      surface.color[static_cast<std::size_t>(k)] =
          std::clamp(static_cast<float>(finite(record.color(k))), 0.0F, 1.0F);
    for (int i = 0; i < 12; ++i) surface.T_map_surface(i / 4, i % 4) = record.pose(i);
    require_rigid(surface.T_map_surface, where_);
    surface.area_m2 = finite(record.area());
    surface.inliers = record.inliers();
    read_rings(record, surface);
    return std::make_shared<const PastSurface>(std::move(surface));
  }

  void read_rings(const history_file::Surface& record, PastSurface& surface) {
    int ring = 0, number = 0;
    std::array<std::int64_t, 2> last{};
    for (const std::uint32_t rings : record.rings()) {
      require(rings > 0 && rings <= static_cast<std::uint32_t>(record.vertices_size() - ring),
              "an outline is not whole");
      Polygon& polygon = surface.polygons.emplace_back();
      for (std::uint32_t k = 0; k < rings; ++k, ++ring) {
        const std::uint32_t vertices = record.vertices(ring);
        require(vertices >= 3 && vertices <= static_cast<std::uint32_t>(record.uv_size() - number) / 2,
                "an outline is not whole");
        Ring2& to = k == 0 ? polygon.outer : polygon.holes.emplace_back();
        for (std::uint32_t i = 0; i < vertices; ++i) {
          for (std::size_t axis = 0; axis < 2; ++axis) {
            const std::int64_t step = record.uv(number++);
            require(step >= -farthest_step && step <= farthest_step, "an outline is too large");
            last[axis] += step;
            require(last[axis] >= -farthest_step && last[axis] <= farthest_step, "an outline is too large");
          }
          to.emplace_back(static_cast<double>(last[0]) * io::history_step_m,
                          static_cast<double>(last[1]) * io::history_step_m);
        }
        entries_ += vertices;
      }
    }
    require(ring == record.vertices_size() && number == record.uv_size(), "an outline is not whole");
  }

  CylinderPtr cylinder(const history_file::Cylinder& record, std::uint64_t latest) const {
    require(record.shape_size() == 13 && record.revision() <= latest && record.born() <= latest,
            "a cylinder makes no sense");
    for (const double number : record.shape()) finite(number);
    const auto vector = [&](int first) {
      return Eigen::Vector3d(record.shape(first), record.shape(first + 1), record.shape(first + 2));
    };
    Cylinder cylinder;
    cylinder.id = record.id();
    cylinder.born = record.born();
    cylinder.revision = record.revision();
    cylinder.axis_point = vector(0);
    cylinder.axis = vector(3);
    cylinder.radius_m = record.shape(6);
    cylinder.length_m = record.shape(7);
    cylinder.start = vector(8);
    cylinder.span_rad = record.shape(11);
    cylinder.rms_m = record.shape(12);
    cylinder.inliers = record.inliers();
    return std::make_shared<const Cylinder>(cylinder);
  }

  std::string where_;
  std::ifstream in_;
  io::RecordReader records_;
  std::string bytes_;
  std::size_t entries_ = 0;
};

void write(const History& history, std::ostream& out) {
  out.write(io::history_file_magic.data(), io::history_file_magic.size());
  for (int shift = 0; shift < 32; shift += 8)
    out.put(static_cast<char>(io::history_file_version >> shift & 0xff));
  io::RecordWriter records(out);
  Record header;
  header.mutable_header()->set_stride(history.stride());
  header.mutable_header()->set_moments(history.moments().size());
  records.put(header.SerializeAsString());
  const Moment* before = nullptr;
  for (const Moment& moment : history.moments()) {
    Record record;
    write_moment(before, moment, *record.mutable_moment());
    records.put(record.SerializeAsString());
    before = &moment;
  }
  Record footer;
  footer.mutable_footer()->set_crc32(records.crc32());
  records.put(footer.SerializeAsString());
  records.finish(history_stream.least_file(records.bytes()));
}

}  // namespace

void save_history(const History& history, const fs::path& file, bool force) {
  io::NewFile output(file, force);
  output.write([&](std::ostream& out) { write(history, out); });
  output.commit();
}

History load_history(const fs::path& file) { return HistoryReader(file)(); }

}  // namespace octosurf
