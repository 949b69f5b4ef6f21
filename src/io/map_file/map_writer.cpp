#include "io/map_file/map_file.hpp"
#include "io/map_file/record_numbers.hpp"
#include "io/map_file/records.hpp"
#include "map_file.pb.h"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

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

std::string header_of(const surfaces::MapState& state) {
  map_file::Header header;
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
  header.set_removals_left_out(state.removals.left_out());
  header.set_removals_complete_since(state.removals.complete_since());
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
  return header.SerializeAsString();
}

/// Puts rows of up to values_per_row values, from `key` on.
template <class Message, class Values, class Add>
void put_in_rows(RowWriter& rows, Table table, std::int64_t key, const Values& values, const Add& add) {
  for (std::size_t i = 0; i < values.size(); ++key) {
    Message message;
    for (const std::size_t end = std::min(values.size(), i + values_per_row); i < end; ++i) add(i, message);
    rows.put(table, key, message.SerializeAsString());
  }
}

void write_removal(const Removal& removal, map_file::Removal& record) {
  if (removal.of == Removal::Of::cylinder) record.set_cylinder(true);
  record.set_id(removal.id);
  if (removal.into != 0) record.set_into(removal.into);
  if (removal.born != 0) record.set_born(removal.born);
  record.set_revision(removal.revision);
  for (const SurfaceId parent : removal.parents) record.add_parents(parent);
}

}  // namespace

SavedMap& saved_of(const surfaces::MapState& state) {
  if (!state.saved) state.saved = std::make_shared<SavedMap>();
  return *static_cast<SavedMap*>(state.saved.get());
}

MapHead::MapHead(const surfaces::MapState& state, OccupancyView octree, const SavedMap* before)
    : limits_{state.parameters, state.revision, state.surfaces.next_id()},
      header_(header_of(state)),
      octree_(std::move(octree)),
      memory_(state.occupancy.bytes()),
      anew_(before == nullptr),
      queue_(state.queue),
      held_(state.held),
      removals_(state.removals),
      read_snapshot_(state.snapshot.keep()) {
  if (before != nullptr && before->history == octree_.tree()->history()) since_ = before->shares;
  for (const auto& [id, surface] : state.surfaces) surfaces_.emplace_back(surface.head(), surface.size());
  for (const auto& [id, cylinder] : state.cylinders) {
    map_file::Cylinder record;
    write_cylinder(cylinder, record);
    read_back([&] { read_cylinder(record, state, {}); });
    cylinders_.emplace_back(id, record.SerializeAsString());
    memory_ += inlier_cost * cylinder.inliers.size();
  }
  const alignment::SeenPatches& patches = alignment::record_of(state).patches;
  memory_ += patch_cost * patches.size();
  const auto take = [&](const auto& blocks) {
    for (const auto block : blocks)
      patches_.emplace_back(block, patches.in_block(static_cast<alignment::SeenPatches::Key>(block)));
  };
  before != nullptr ? take(before->changed_blocks) : take(patches.blocks());
}

void MapHead::write_surfaces(RowWriter& rows) const {
  for (const auto& [head, inliers] : surfaces_) {
    surfaces::SurfaceModel::State surface = head;
    surface.polygons = snapshot_->find(head.id)->polygons;
    map_file::Surface record;
    write_surface(surface, inliers, record);
    rows.put(Table::surfaces, head.id, record.SerializeAsString());
    read_back([&] { read_surface(record, limits_, {}); });
  }
}

void MapHead::write_queue(RowWriter& rows) const {
  std::map<std::int64_t, std::pair<KeySteps, map_file::Accumulated>> cubes;
  for (const geometry::VoxelKey& key : queue_.fresh) {
    auto& [steps, record] = cubes[cube_of(key)];
    record.add_steps(steps.to(key));
  }
  for (const auto& [cube, steps] : cubes) rows.put(Table::waiting, cube, steps.second.SerializeAsString());
  put_in_rows<map_file::Accumulated>(
      rows, Table::waiting, first_blocks, queue_.blocks,
      [&](std::size_t i, auto& record) { record.add_blocks(queue_.blocks[i].packed()); });
}

void MapHead::write(RowWriter& rows, const MapFiles& files) const {
  snapshot_ = read_snapshot_();
  rows.put(Table::state, header_key, header_);
  occupancy::for_each_part(octree_, since_, [&](std::uint64_t path, const std::string& nodes) {
    const auto key = static_cast<std::int64_t>(path);
    nodes.empty() ? rows.keep(Table::octree, key) : rows.put(Table::octree, key, nodes);
  });
  write_queue(rows);
  put_in_rows<map_file::Held>(rows, Table::held, 0, held_,
                              [&](std::size_t i, auto& record) { record.add_scans(held_[i]); });
  write_surfaces(rows);
  for (const auto& [id, content] : cylinders_) rows.put(Table::cylinders, id, content);
  std::vector<Removal> removals;
  removals_.for_each_since(0, [&](const Removal& removal) { removals.push_back(removal); });
  const auto first_row = static_cast<std::int64_t>(removals_.left_out() / values_per_row);
  put_in_rows<map_file::Removals>(
      rows, Table::removals, first_row, removals,
      [&](std::size_t i, auto& record) { write_removal(removals[i], *record.add_removals()); });
  if (!anew_) rows.keep_all(Table::seen_patches);
  for (const auto& [block, patches] : patches_) {
    if (patches.empty()) continue;  // a scan that was taken back had made it: no file has it
    map_file::SeenPatches record;
    for (const alignment::SeenPatches::Change& patch : patches) write_patch(patch, record);
    rows.put(Table::seen_patches, static_cast<std::int64_t>(block), record.SerializeAsString());
  }
  const KeptScans& scans = files.scans;
  put_in_rows<map_file::ScanPoses>(rows, Table::kept_scans, 0, scans.poses, [&](std::size_t i, auto& record) {
    for (int k = 0; k < 12; ++k) record.add_values(scans.poses[i](k / 4, k % 4));
    if (i < scans.marks.size()) record.add_marks(scans.marks[i]);
  });
  rows.finish();
  map_file::Files record;
  for (const FileSum& bt : files.bt) {
    record.add_bt_bytes(bt.bytes);
    record.add_bt_crc32(bt.crc32);
  }
  record.set_bt_revision(files.bt_revision);
  if (!scans.folder.empty()) record.set_kept_scans(scans.folder.string());
  if (scans.shared) record.set_kept_scans_shared(true);
  const RowSums::Total total = rows.sums().total();
  record.set_rows(total.count);
  record.set_digest(total.digest);
  rows.put(Table::state, files_key, record.SerializeAsString());
}

std::uint64_t MapHead::memory(const KeptScans& scans) const {
  std::uint64_t bytes = memory_ + waiting_cost * (queue_.fresh.size() + queue_.blocks.size()) +
                        pose_cost * scans.poses.size() + held_cost * (held_.size() + scans.marks.size()),
                checking = 0;
  for (const SurfacePtr& surface : snapshot_->surfaces) {
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
  removals_.for_each_since(
      0, [&](const Removal& removal) { bytes += removal_cost + sizeof(SurfaceId) * removal.parents.size(); });
  return (bytes + checking) / 4 * 5;
}

}  // namespace octosurf::io
