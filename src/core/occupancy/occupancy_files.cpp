// The octree's way to and from bytes. OctoMap's own readers recurse without a limit and read on
// past the end of a file, so its two formats are parsed here, with both checked.
#include "occupancy/key_box.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/voxel_tree.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>
#include <strings.h>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

constexpr std::size_t chunk_bytes = std::size_t{1} << 20;

// Memory limit for a .bt, which has two bits for a voxel: a scanned building takes 37 times its size, and the
// maximum is 144 times.
constexpr std::size_t free_bytes = std::size_t{32} << 20, bytes_per_file_byte = 64;

/// OctoMap's .bt: two bits a child, in preorder; undivided where eight children are equal.
class BtWriter {
 public:
  /// Of cubes that meet `box`.
  explicit BtWriter(const occupancy::VoxelTree& tree, const occupancy::KeyBox& box = {})
      : tree_(tree), box_(box) {
    if (!tree.empty()) write(tree.root(), {0, 0, 0}, occupancy::VoxelTree::top_level);
  }
  const std::string& bytes() const { return bytes_; }
  std::size_t nodes() const { return nodes_; }

 private:
  enum Kind : unsigned { unknown = 0, free = 1, occupied = 2, inner = 3 };

  /// Appends the subtree of `node`; nothing if it is uniform or beside the box.
  Kind write(const occupancy::VoxelTree::Node& node, const occupancy::Key3& corner, int level) {
    if (!box_.meets(occupancy::KeyBox::cube(corner, level))) return unknown;
    ++nodes_;
    if (!node.has_children()) return tree_.occupied(node.log_odds()) ? occupied : free;
    const std::size_t start = bytes_.size(), nodes_before = nodes_;
    bytes_.append(2, '\0');
    unsigned bits = 0;
    for (unsigned c = 0; c < 8; ++c)
      if (const occupancy::VoxelTree::Node child = node.child(c); child.exists())
        bits |= write(child, occupancy::child_corner(corner, c, level - 1), level - 1) << (2 * c);
    if (bits == 0 || bits == all_free || bits == all_occupied) {
      bytes_.resize(start);
      nodes_ = nodes_before;
      return bits == 0 ? unknown : bits == all_free ? free : occupied;
    }
    bytes_[start] = static_cast<char>(bits & 0xff);
    bytes_[start + 1] = static_cast<char>(bits >> 8);
    return inner;
  }

  static constexpr unsigned all_free = 0x5555, all_occupied = 0xaaaa;
  const occupancy::VoxelTree& tree_;
  const occupancy::KeyBox box_;
  std::string bytes_;
  std::size_t nodes_ = 0;
};

/// Appends OctoMap's .ot, of cubes that meet `box`: log-odds and a byte of child bits, in preorder; an inner
/// node has its greatest child's value; undivided where eight leaves are equal. Returns the node's value.
std::optional<float> write_ot(const occupancy::VoxelTree::Node& node, const occupancy::KeyBox& box,
                              const occupancy::Key3& corner, int level, std::string& out) {
  if (!box.meets(occupancy::KeyBox::cube(corner, level))) return {};
  const std::size_t size = sizeof(float) + 1, start = out.size(), first = start + size;
  out.resize(first);
  std::optional<float> value;
  unsigned mask = 0;
  if (!node.has_children()) value = node.log_odds();
  for (unsigned c = 0; c < 8 && node.has_children(); ++c)
    if (const occupancy::VoxelTree::Node child = node.child(c); child.exists())
      if (const auto of =
              write_ot(child, box, occupancy::child_corner(corner, c, level - 1), level - 1, out)) {
        value = std::max(value, of);
        mask |= 1U << c;
      }
  if (out.size() == first + 8 * size && out.compare(first, 7 * size, out, first + size, 7 * size) == 0)
    out.resize(first), mask = 0;
  out[first - 1] = static_cast<char>(mask);
  if (value) std::memcpy(out.data() + start, &*value, sizeof(float));
  if (!value) out.resize(start);
  return value;
}

/// Appends a map's own nodes, in preorder: a byte of child bits; without any log-odds, and its point.
void write_own(const occupancy::VoxelTree::Node& node, std::string& out) {
  const auto put = [&out](const auto& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  std::uint8_t mask = 0;
  if (node.has_children())
    for (unsigned c = 0; c < 8; ++c) mask |= static_cast<std::uint8_t>(node.child(c).exists() << c);
  put(mask);
  if (mask == 0) {
    const occupancy::VoxelPayload* payload = node.payload();
    put(node.log_odds());
    put(static_cast<std::uint8_t>(payload != nullptr));
    if (payload != nullptr) put(*payload);
  }
  for (unsigned c = 0; c < 8; ++c)
    if (mask >> c & 1) write_own(node.child(c), out);
}

/// Reads a tree's nodes in preorder, in one of three formats. Throws Error(data) for all that is not one.
class TreeReader {
 public:
  /// Says what an error is about: `where` it is, how its text begins, how it is mended.
  struct Subject {
    std::string where, damage, hint;
  };
  using Key = occupancy::Key3;

  /// `source` gives the next bytes; none: it ends there.
  TreeReader(occupancy::VoxelTree& tree, const std::function<std::string()>& source, Subject subject,
             std::size_t most_bytes = std::numeric_limits<std::size_t>::max())
      : tree_(tree), source_(source), subject_(std::move(subject)), most_bytes_(most_bytes) {}

  /// As write_own() has them.
  void read_own(const Key& corner = {}, int level = top) {
    const auto mask = get<std::uint8_t>();
    if (mask == 0) {
      const auto log_odds = get_log_odds();
      set_leaf(corner, level, log_odds);
      if (get<std::uint8_t>() == 0) return;
      const auto payload = get<occupancy::VoxelPayload>();
      if (!payload.has_point()) fail("a point has no distance class");
      if (level != 0 || !tree_.occupied(log_odds)) fail("a point stands in a voxel that cannot hold one");
      tree_.make_payload(occupancy::key_of(corner)) = payload;
      return;
    }
    divide(corner, level);
    for (unsigned c = 0; c < 8; ++c)
      if (mask >> c & 1) read_own(occupancy::child_corner(corner, c, level - 1), level - 1);
  }

  /// OctoMap's .ot: log-odds and `dropped` bytes, then a byte of child bits.
  void read_ot(std::size_t dropped, const Key& corner = {}, int level = top) {
    ++nodes_;
    const auto log_odds = get_log_odds();
    for (std::size_t i = 0; i < dropped; ++i) get<std::uint8_t>();
    const auto mask = get<std::uint8_t>();
    if (mask == 0) return set_leaf(corner, level, log_odds);
    divide(corner, level);
    for (unsigned c = 0; c < 8; ++c)
      if (mask >> c & 1) read_ot(dropped, occupancy::child_corner(corner, c, level - 1), level - 1);
  }

  /// OctoMap's .bt: two bits a child: 00 unknown, 01 free (low bit first), 10 occupied, 11 has children.
  void read_bt(const Key& corner = {}, int level = top) {
    ++nodes_;
    const auto bits = get<std::uint16_t>();
    if (bits == 0) return set_leaf(corner, level, 0);  // OctoMap's value for an unset node
    divide(corner, level);
    for (unsigned c = 0; c < 8; ++c) {
      const unsigned kind = bits >> (2 * c) & 3;
      nodes_ += kind == 1 || kind == 2;
      if (kind == 1 || kind == 2)
        set_leaf(occupancy::child_corner(corner, c, level - 1), level - 1,
                 kind == 1 ? tree_.model().clamp_min : tree_.model().clamp_max);
    }
    for (unsigned c = 0; c < 8; ++c)
      if ((bits >> (2 * c) & 3) == 3) read_bt(occupancy::child_corner(corner, c, level - 1), level - 1);
  }

  std::size_t nodes() const { return nodes_; }  ///< of OctoMap's
  bool at_end() {
    if (position_ == chunk_.size()) {
      chunk_ = source_();
      position_ = 0;
    }
    return chunk_.empty();
  }
  void require_end() {
    if (!at_end()) fail("bytes are left over");
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::data, subject_.where, subject_.damage + what, subject_.hint);
  }

 private:
  static constexpr int top = occupancy::VoxelTree::top_level, brick = occupancy::VoxelTree::brick_level;

  void divide(const Key& corner, int level) {
    if (level == 0) fail("deeper than 16 levels");
    if (level == brick) brick_ = &tree_.make_brick(occupancy::key_of(corner));
  }
  void set_leaf(const Key& at, int level, float log_odds) {
    const geometry::VoxelKey corner = occupancy::key_of(at);
    // Most leaves are in bricks: descending from the root to each would take half of the time.
    if (level < brick)
      occupancy::VoxelTree::set_leaf(*brick_, corner, level, log_odds);
    else
      tree_.set_leaf(corner, level, log_odds);
    if (tree_.bytes() > most_bytes_) fail("it takes far more memory than its size allows");
  }
  float get_log_odds() {
    const auto log_odds = get<float>();
    if (!std::isfinite(log_odds)) fail("a log-odds is not finite");
    return log_odds;
  }
  template <class T>
  T get() {
    T value{};
    auto* bytes = reinterpret_cast<char*>(&value);
    if (chunk_.size() - position_ >= sizeof value) {
      std::memcpy(bytes, chunk_.data() + position_, sizeof value);
      position_ += sizeof value;
      return value;
    }
    for (std::size_t i = 0; i < sizeof value; ++i) {
      if (at_end()) fail("it ends too early");
      bytes[i] = chunk_[position_++];
    }
    return value;
  }

  occupancy::VoxelTree& tree_;
  const std::function<std::string()>& source_;
  const Subject subject_;
  const std::size_t most_bytes_;
  std::string chunk_;
  std::size_t position_ = 0, nodes_ = 0;
  occupancy::VoxelTree::Brick* brick_ = nullptr;  // current brick
};

constexpr const char* octomap_hint = "expected an OctoMap .bt or .ot";

/// An open .bt or .ot, its header read: text lines up to "data", then bytes.
class OctomapFile {
 public:
  explicit OctomapFile(const std::filesystem::path& file) : file_(file), in_(file, std::ios::binary) {
    if (!in_) refuse("cannot be opened");
    std::string head(longest_header, '\0');
    in_.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(in_.gcount()));
    const std::size_t begin = read_first_header(head) ? 16 : read_text(head);
    if (!(resolution >= 1e-3 && resolution <= 10)) refuse("has no usable resolution");
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(begin));
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (error) refuse("cannot be read");
    bytes_ = static_cast<std::size_t>(size);
    if (!binary_ && nodes_ != 0) dropped = dropped_bytes(bytes_ - begin);
  }

  std::string id = "OcTree";
  double resolution = 0;
  std::size_t dropped = 0;  ///< .ot: bytes of a node after its log-odds

  void read(occupancy::VoxelTree& tree) {
    const std::function<std::string()> source = [&] {
      std::string chunk(chunk_bytes, '\0');
      in_.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
      chunk.resize(static_cast<std::size_t>(in_.gcount()));
      return chunk;
    };
    TreeReader reader(tree, source, {file_.string(), "is damaged: ", octomap_hint},
                      free_bytes + bytes_per_file_byte * bytes_);
    if (nodes_ == 0 && reader.at_end()) return;  // an empty map
    binary_ ? reader.read_bt() : reader.read_ot(dropped);
    if (nodes_ && *nodes_ != reader.nodes())
      reader.fail(std::to_string(reader.nodes()) + " nodes where its header says " + std::to_string(*nodes_));
    reader.require_end();
  }

 private:
  static constexpr std::size_t longest_header = std::size_t{1} << 16;

  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Error::Kind::data, file_.string(), what, octomap_hint);
  }

  /// OctoMap's first .bt began with a 3, resolution and size in binary.
  bool read_first_header(const std::string& head) {
    std::int32_t type = 0;
    std::uint32_t nodes = 0;
    if (head.size() >= 16) std::memcpy(&type, head.data(), sizeof type);
    if (type != 3) return false;
    std::memcpy(&resolution, head.data() + 4, sizeof resolution);
    std::memcpy(&nodes, head.data() + 12, sizeof nodes);
    nodes_ = nodes;
    return binary_ = true;
  }

  /// Returns where the nodes begin.
  std::size_t read_text(const std::string& head) {
    const auto begins_with = [&](std::string_view text) {
      return strncasecmp(head.c_str(), text.data(), text.size()) == 0;
    };
    binary_ = begins_with("# octomap octree binary file");
    if (!binary_ && !begins_with("# octomap octree file"))
      refuse(head.empty() ? "is empty" : "is not an OctoMap file");
    std::istringstream lines(head);
    std::string line, word;
    std::getline(lines, line);
    while (std::getline(lines, line) && !lines.eof()) {
      if (line.ends_with('\r')) refuse("was copied as text, which breaks it: its lines end in CR LF");
      std::istringstream words(line);
      words >> word;
      if (word == "id") words >> id;
      if (word == "res") words >> resolution;
      if (std::size_t nodes = 0; word == "size" && words >> nodes) nodes_ = nodes;
      if (word != "data") continue;
      if (id == "CountingOcTree") refuse("holds counts, not occupancy");
      if (id == "1") id = "OcTree";  // its older name
      return static_cast<std::size_t>(lines.tellg());
    }
    refuse("ends within its header");
  }

  /// Other types than OctoMap's own (with time stamps, labels) are known by the bytes that a node takes; of
  /// its fields log-odds come first.
  std::size_t dropped_bytes(std::size_t left) const {
    if (id == "OcTree") return 0;
    if (id == "ColorOcTree") return 3;
    const std::size_t nodes = nodes_.value_or(0);
    constexpr std::size_t least = sizeof(float) + 1;  // log-odds, children
    if (nodes == 0 || left % nodes != 0 || left / nodes < least) refuse("holds a tree of type '" + id + "'");
    return left / nodes - least;
  }

  std::filesystem::path file_;
  std::ifstream in_;
  std::size_t bytes_ = 0;
  bool binary_ = false;
  std::optional<std::size_t> nodes_;
};

}  // namespace

void occupancy::write_bt(const OccupancyView& view, std::ostream& out) {
  const BtWriter writer(*view.tree());
  out << "# Octomap OcTree binary file\n"
         "# (feel free to add / change comments, but leave the first line as it is!)\n#\nid OcTree\nsize "
      << writer.nodes() << "\nres " << view.resolution() << "\ndata\n";
  out.write(writer.bytes().data(), static_cast<std::streamsize>(writer.bytes().size()));
}

std::string OccupancyView::octomap_data(const Eigen::AlignedBox3d& box, bool full) const {
  if (!tree_) return {};
  const auto keys = box.isEmpty() ? occupancy::KeyBox() : occupancy::keys_that_meet(box, resolution_);
  if (!full) return BtWriter(*tree_, keys).bytes();
  std::string nodes;
  if (!tree_->empty()) write_ot(tree_->root(), keys, {0, 0, 0}, occupancy::VoxelTree::top_level, nodes);
  return nodes;
}

void occupancy::for_each_part(const OccupancyView& view, std::optional<std::uint32_t> since,
                              const std::function<void(std::uint64_t, const std::string&)>& visit) {
  if (view.tree() == nullptr || view.tree()->empty()) return;
  std::string nodes;
  const auto below = [&](const auto& self, const VoxelTree::Node& node, std::uint64_t path) -> void {
    if (node.has_children() && node.level() > part_level) {
      for (unsigned c = 0; c < 8; ++c)
        if (const VoxelTree::Node child = node.child(c); child.exists()) self(self, child, path << 3 | c);
      return;
    }
    nodes.clear();
    if (!since || node.written_since(*since)) write_own(node, nodes);
    visit(path, nodes);
  };
  below(below, view.tree()->root(), 1);
}

void occupancy::OccupancyMap::read_part(std::uint64_t path, std::string nodes, const std::string& where) {
  constexpr std::size_t leaf_bytes = 1 + sizeof(float) + 1;
  const int bits = static_cast<int>(std::bit_width(path)) - 1, level = VoxelTree::top_level - bits / 3;
  const bool is_one = bits >= 0 && bits % 3 == 0 && level >= part_level &&
                      (level == part_level || nodes.size() == leaf_bytes);
  const std::function<std::string()> source = [&] { return std::exchange(nodes, {}); };
  TreeReader reader(*tree_, source, {where, "damaged octree: ", "restore the file from a backup"});
  if (!is_one) reader.fail("there is no such part");
  reader.read_own(ints(VoxelTree::key_of((path ^ std::uint64_t{1} << bits) << (3 * level))), level);
  reader.require_end();
}

double read_octomap_resolution(const std::filesystem::path& file) { return OctomapFile(file).resolution; }

std::string octomap_note(const std::filesystem::path& file) {
  const OctomapFile read(file);
  if (read.id == "OcTree") return {};
  return "octree: of type " + read.id + ", whose occupancy is taken" +
         (read.dropped > 0 ? ", and the " + std::to_string(read.dropped) +
                                 " bytes a node has besides (colour, time or labels) left"
                           : "");
}

occupancy::OccupancyMap occupancy::OccupancyMap::read_octomap(const std::filesystem::path& file,
                                                              OccupancyParameters parameters) {
  OctomapFile octree(file);
  parameters.resolution = octree.resolution;
  occupancy::OccupancyMap map(parameters);
  octree.read(*map.tree_);
  return map;
}

}  // namespace octosurf
