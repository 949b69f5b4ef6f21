#include "io/map_file/map_file.hpp"
#include "io/map_file/record_numbers.hpp"
#include "io/map_file/records.hpp"
#include "map_file.pb.h"

#include <algorithm>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::size_t keys_in_record = 65536;  // or fingerprints
constexpr std::size_t poses_in_record = 8192;
constexpr std::size_t removals_bytes = 1U << 16;
constexpr std::size_t patches_in_record = 1000;

void put_record(const map_file::Record& record, RecordWriter& records) {
  records.put(record.SerializeAsString());
}

/// Reads a record as it will be read: what a reader would refuse shall not replace a map that it takes.
template <class Read>
void read_back(const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    const std::string what = error.what();
    throw Error(Error::Kind::output, "the map",
                what.substr(0, what.size() - error.hint().size() - 2) + ", and is not saved so",
                "what was saved before is left as it is; report this with the map's parameters");
  }
}

void write_header(const surfaces::MapState& state, const FileSum& bt, const KeptScans& scans,
                  map_file::Header& header) {
  for (const ParameterInfo& info : parameter_infos()) {
    map_file::Parameter& parameter = *header.add_parameters();
    parameter.set_name(info.name);
    if (const auto value = parameter_value(state.parameters, info.name)) parameter.set_value(*value);
  }
  header.set_revision(state.revision);
  header.set_scans(state.scans);
  header.set_points(state.points);
  header.set_next_id(state.surfaces.next_id());
  header.set_next_cylinder_id(state.cylinders.next_id());
  header.set_range_noise(state.noise.range_noise());
  for (const auto& range_class : state.noise.histogram())
    for (const std::uint32_t count : range_class) header.add_noise_histogram(count);
  const auto put = [&](const sensing::NoiseModel::SharedError& error) {
    header.add_shared_error_variances(error.variance);
    header.add_shared_error_scans(error.scans);
  };
  for (const sensing::NoiseModel::SharedError& error : state.noise.shared_errors().of_class) put(error);
  put(state.noise.shared_errors().of_surface);
  for (const double coordinate : state.sensors_up) header.add_sensors_up(coordinate);
  if (!state.origin.isZero(0))
    for (const double coordinate : state.origin) header.add_origin(coordinate);
  if (const alignment::AlignmentState& known = alignment::record_of(state).state; !known.hypotheses.empty())
    write_alignment(known, *header.mutable_alignment());
  if (header.has_alignment()) read_back([&] { read_alignment(*header.mutable_alignment(), {}); });
  header.set_bt_bytes(bt.bytes);
  header.set_bt_crc32(bt.crc32);
  if (scans.folder.empty()) return;
  header.set_kept_scans(scans.folder.string());
  if (scans.shared) header.set_kept_scans_shared(true);
}

/// Writes records of up to `of_each` values.
template <class Value, class Add>
void put_in_records(const std::vector<Value>& values, std::size_t of_each, RecordWriter& records,
                    const Add& add) {
  for (std::size_t i = 0; i < values.size();) {
    map_file::Record record;
    for (const std::size_t end = std::min(values.size(), i + of_each); i < end; ++i) add(values[i], record);
    put_record(record, records);
  }
}

void put_queue(const surfaces::PendingQueue& queue, RecordWriter& records) {
  KeySteps steps;
  put_in_records(queue.fresh, keys_in_record, records, [&](const geometry::VoxelKey& key, auto& record) {
    record.mutable_accumulated()->add_steps(steps.to(key));
  });
  put_in_records(queue.blocks, keys_in_record, records, [](const geometry::VoxelKey& key, auto& record) {
    record.mutable_accumulated()->add_blocks(key.packed());
  });
}

void write_removal(const Removal& removal, map_file::Removal& record) {
  if (removal.of == Removal::Of::cylinder) record.set_cylinder(true);
  record.set_id(removal.id);
  if (removal.into != 0) record.set_into(removal.into);
  if (removal.born != 0) record.set_born(removal.born);
  record.set_revision(removal.revision);
  for (const SurfaceId parent : removal.parents) record.add_parents(parent);
}

void put_removals(const RemovalLog& log, RecordWriter& records) {
  map_file::Record record;
  log.for_each_since(0, [&](const Removal& removal) {
    write_removal(removal, *record.mutable_removals()->add_removals());
    if (record.ByteSizeLong() < removals_bytes) return;
    put_record(record, records);
    record.Clear();
  });
  if (record.has_removals()) put_record(record, records);
}

/// Memory for reading it, as the reader counts; a quarter more, because pools grow in steps.
std::uint64_t memory_of(const surfaces::MapState& state, const KeptScans& scans) {
  std::uint64_t bytes = state.occupancy.bytes() +
                        waiting_cost * (state.queue.fresh.size() + state.queue.blocks.size()) +
                        pose_cost * scans.poses.size() +
                        held_cost * (state.held.size() + scans.marks.size()) +
                        patch_cost * alignment::record_of(state).patches.size(),
                checking = 0;
  for (const auto snapshot = state.snapshot.read(); const SurfacePtr& surface : snapshot->surfaces) {
    std::uint64_t vertices = 0, rings = 0;
    for (const Polygon& polygon : surface->polygons) {
      vertices += polygon.outer.size();
      rings += 1 + polygon.holes.size();
      for (const Ring2& hole : polygon.holes) vertices += hole.size();
    }
    bytes += inlier_cost * surface->inliers + surface_cost + sizeof(SurfaceId) * surface->parents.size() +
             vertex_cost * (vertices + rings);
    checking = std::max(checking, check_cost * vertices);
  }
  for (const auto& [id, cylinder] : state.cylinders) bytes += inlier_cost * cylinder.inliers.size();
  state.removals.for_each_since(
      0, [&](const Removal& removal) { bytes += removal_cost + sizeof(SurfaceId) * removal.parents.size(); });
  return (bytes + checking) / 4 * 5;
}

void put_surface(surfaces::SurfaceModel::State surface, const surfaces::MapState& state,
                 RecordWriter& records) {
  map_file::Record record;
  write_surface(surface, *record.mutable_surface());
  read_back([&] { read_surface(*record.mutable_surface(), std::move(surface.inliers), state, {}); });
  put_record(record, records);
}

}  // namespace

void write_map(const surfaces::MapState& state, const FileSum& bt, std::ostream& out,
               const KeptScans& scans) {
  out.write(map_file_magic.data(), map_file_magic.size());
  for (int shift = 0; shift < 32; shift += 8) out.put(static_cast<char>(map_file_version >> shift & 0xff));

  RecordWriter records(out);
  map_file::Record header;
  write_header(state, bt, scans, *header.mutable_header());
  put_record(header, records);
  state.occupancy.write_nodes([&](const std::string& chunk) {
    map_file::Record record;
    record.set_octree(chunk);
    put_record(record, records);
  });
  put_queue(state.queue, records);
  put_in_records(scans.poses, poses_in_record, records, [](const Eigen::Isometry3d& T, auto& record) {
    for (int k = 0; k < 12; ++k) record.mutable_scan_poses()->add_values(T(k / 4, k % 4));
  });
  put_in_records(state.held, keys_in_record, records,
                 [](std::uint64_t scan, auto& record) { record.mutable_scan_poses()->add_held(scan); });
  put_in_records(scans.marks, keys_in_record, records,
                 [](std::uint32_t mark, auto& record) { record.mutable_scan_poses()->add_marks(mark); });
  const std::shared_ptr<const Snapshot> snapshot = state.snapshot.read();
  for (const auto& [id, surface] : state.surfaces) put_surface(surface.state(snapshot.get()), state, records);
  for (const auto& [id, cylinder] : state.cylinders) {
    map_file::Record record;
    write_cylinder(cylinder, *record.mutable_cylinder());
    read_back([&] { read_cylinder(*record.mutable_cylinder(), state, {}); });
    put_record(record, records);
  }
  put_removals(state.removals, records);
  put_in_records(alignment::record_of(state).patches.all(), patches_in_record, records,
                 [](const auto& patch, auto& record) { write_patch(patch, *record.mutable_seen_patches()); });
  map_file::Record footer;
  footer.mutable_footer()->set_records(records.records());
  footer.mutable_footer()->set_crc32(records.crc32());
  put_record(footer, records);
  records.finish(
      std::max(map_stream.least_file(records.bytes()), map_memory.least_file(memory_of(state, scans))));
}

}  // namespace octosurf::io
