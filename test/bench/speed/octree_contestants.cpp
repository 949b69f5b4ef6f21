// Occupancy: OctoMap's insertion and ours, and reading what they saved.

#include "bench/speed/contestant.hpp"
#include "occupancy/occupancy_map.hpp"

#include <cmath>
#include <limits>
#include <octomap/OcTree.h>
#include <optional>
#include <sstream>

#include <octosurf/adapters/octomap.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf::bench {
namespace {

octomap::Pointcloud cloud_in_map(const Scan& scan) {
  octomap::Pointcloud cloud;
  cloud.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) {
    if (!point.allFinite()) continue;
    const Eigen::Vector3f in_map = (scan.T_map_sensor * point.cast<double>()).cast<float>();
    cloud.push_back(in_map.x(), in_map.y(), in_map.z());
  }
  return cloud;
}

std::size_t known_voxels(const octomap::OcTree& tree) {
  std::size_t voxels = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    voxels += std::size_t{1} << (3 * (tree.getTreeDepth() - leaf.getDepth()));
  return voxels;
}

/// Voxels in which two trees differ: every voxel OctoMap knows is looked up in ours (`value(key)`, NaN
/// where it is unknown), and both must know equally many.
template <class Value>
std::size_t differing_voxels(const octomap::OcTree& theirs, std::size_t our_known, const Value& value) {
  std::size_t differing = 0;
  for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
    const octomap::OcTreeKey first = leaf.getIndexKey();
    const unsigned edge = 1u << (theirs.getTreeDepth() - leaf.getDepth());
    for (unsigned i = 0; i < edge * edge * edge; ++i) {
      const auto along = [&](unsigned axis, unsigned step) {
        return static_cast<std::uint16_t>(first[axis] + step);
      };
      const geometry::VoxelKey key{along(0, i % edge), along(1, i / edge % edge), along(2, i / edge / edge)};
      differing += value(key) != leaf->getLogOdds();
    }
  }
  const std::size_t their_known = known_voxels(theirs);
  return differing + (our_known > their_known ? our_known - their_known : their_known - our_known);
}

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

std::size_t differing_voxels(const octomap::OcTree& theirs, const occupancy::OccupancyMap& ours) {
  std::stringstream written;
  ours.write_bt(written);
  octomap::OcTree read_back(theirs.getResolution());
  if (!read_back.readBinary(written)) throw Error(Error::Kind::data, "write_bt", "OctoMap does not read it");
  return differing_voxels(theirs, known_voxels(read_back), [&](geometry::VoxelKey key) {
    const occupancy::OccupancyMap::Lookup found = ours.at(key);
    return found.state == occupancy::OccupancyMap::State::unknown ? unknown : found.log_odds;
  });
}

std::size_t differing_voxels(const octomap::OcTree& theirs, const octomap::OcTree& ours) {
  return differing_voxels(theirs, known_voxels(ours), [&](geometry::VoxelKey key) {
    const octomap::OcTreeNode* const node = ours.search(octomap::OcTreeKey(key.x, key.y, key.z));
    return node == nullptr ? unknown : node->getLogOdds();
  });
}

/// {"differ", "voxels"}: a tree of ours against the one that an OctomapSide wrote to `file`.
template <class Tree>
Json comparison(const Tree& ours, const std::string& file) {
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(file));
  const auto* const theirs = dynamic_cast<const octomap::OcTree*>(read.get());
  if (theirs == nullptr) throw Error(Error::Kind::data, file, "OctoMap does not read it");
  return {{"differ", differing_voxels(*theirs, ours)}, {"voxels", known_voxels(*theirs)}};
}

/// OctoMap's input in its own form.
struct OctomapScan {
  octomap::Pointcloud cloud;
  octomap::point3d origin;

  explicit OctomapScan(const Scan& scan) : cloud(cloud_in_map(scan)) {
    const Eigen::Vector3f eye = scan.T_map_sensor.translation().cast<float>();
    origin = octomap::point3d(eye.x(), eye.y(), eye.z());
  }
};

/// OctoMap's way to say unlimited.
double octomap_range(const Json& settings) {
  const double range = max_range_of(settings);
  return std::isinf(range) ? -1 : range;
}

class OctomapSide : public Contestant {
 public:
  explicit OctomapSide(const Json& settings)
      : heap_before_(heap_in_use()),
        tree_(settings.at("resolution").get<double>()),
        max_range_(octomap_range(settings)) {}

  void prepare(const Scan& scan) override { scan_.emplace(scan); }
  void run() override {
    tree_.insertPointCloud(scan_->cloud, scan_->origin, max_range_, true, true);
    tree_.updateInnerOccupancy();
  }

  /// {"write": FILE}: the pruned tree goes there (.ot). Always: its heap, pruned.
  Json tell(const Json& question) override {
    scan_.reset();
    tree_.prune();
    const std::size_t heap = heap_in_use() - heap_before_;
    if (question.contains("write")) {
      const std::string file = question["write"].get<std::string>();
      if (!tree_.write(file)) throw Error(Error::Kind::output, file, "cannot be written");
    }
    return {{"heap", heap}, {"leaves", tree_.getNumLeafNodes()}, {"nodes", tree_.size()}};
  }

 private:
  std::size_t heap_before_;
  octomap::OcTree tree_;
  double max_range_;
  std::optional<OctomapScan> scan_;
};

/// insert_point_cloud on the same kind of tree, which is complete after every scan: not lazy.
class PlainSide : public Contestant {
 public:
  explicit PlainSide(const Json& settings)
      : tree_(settings.at("resolution").get<double>()),
        max_range_(octomap_range(settings)),
        threads_(settings.value("threads", 1)) {}

  void prepare(const Scan& scan) override { scan_.emplace(scan); }
  void run() override {
    insert_point_cloud(tree_, scan_->cloud, scan_->origin, max_range_, false, true, threads_);
  }

  /// {"compare": FILE}: with OctoMap's tree in that file.
  Json tell(const Json& question) override {
    return question.contains("compare") ? comparison(tree_, question["compare"].get<std::string>()) : Json();
  }

 private:
  octomap::OcTree tree_;
  double max_range_;
  int threads_;
  std::optional<OctomapScan> scan_;
};

class OccupancySide : public Contestant {
 public:
  explicit OccupancySide(const Json& settings)
      : heap_before_(heap_in_use()),
        map_(parameters_from(settings).occupancy),
        downsampler_(map_.grid()),
        max_range_(max_range_of(settings)),
        threads_(settings.value("threads", 1)) {}

  void prepare(const Scan& scan) override { scan_ = scan; }
  void run() override {
    map_.insert(downsampler_(scan_, 0, max_range_, threads_), downsampler_, nullptr, threads_);
  }

  /// {"compare": FILE}: with OctoMap's tree in that file. Always: its heap, scratch included.
  Json tell(const Json& question) override {
    scan_ = Scan();
    const occupancy::OccupancyMap::Size size = map_.size();
    Json answer{{"heap", heap_in_use() - heap_before_},
                {"leaves", size.leaves},
                {"nodes", size.nodes},
                {"tree_bytes", size.bytes}};
    if (question.contains("compare")) answer.update(comparison(map_, question["compare"].get<std::string>()));
    return answer;
  }

 private:
  std::size_t heap_before_;
  occupancy::OccupancyMap map_;
  sensing::Downsampler downsampler_;
  double max_range_;
  int threads_;
  Scan scan_;
};

class ReadBinarySide : public Contestant {
 public:
  explicit ReadBinarySide(const Json& settings) : file_(settings.at("file").get<std::string>()) {}
  void run() override {
    if (!tree_.readBinary(file_)) throw Error(Error::Kind::data, file_, "OctoMap does not read it");
  }

 private:
  std::string file_;
  octomap::OcTree tree_{0.1};
};

class LoadMapSide : public Contestant {
 public:
  explicit LoadMapSide(const Json& settings) : file_(settings.at("file").get<std::string>()) {}
  void run() override { loaded_.emplace(load_map(file_)); }

 private:
  std::string file_;
  std::optional<LoadedMap> loaded_;
};

}  // namespace

std::unique_ptr<Contestant> make_octomap(const Json& settings) {
  return std::make_unique<OctomapSide>(settings);
}
std::unique_ptr<Contestant> make_plain(const Json& settings) { return std::make_unique<PlainSide>(settings); }
std::unique_ptr<Contestant> make_occupancy(const Json& settings) {
  return std::make_unique<OccupancySide>(settings);
}
std::unique_ptr<Contestant> make_read_binary(const Json& settings) {
  return std::make_unique<ReadBinarySide>(settings);
}
std::unique_ptr<Contestant> make_load_map(const Json& settings) {
  return std::make_unique<LoadMapSide>(settings);
}

}  // namespace octosurf::bench
