// The octree's way to and from bytes. OctoMap's own readers recurse without a limit and read on
// past the end of a file, so its two formats are parsed here, with both checked.
#include "geometry/morton.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

constexpr std::size_t chunk_bytes = std::size_t{1} << 20;

// Memory limit for a .bt, which has two bits for a voxel: a scanned building takes 37 times its size, and the
// maximum is 144 times.
constexpr std::size_t free_bytes = std::size_t{32} << 20, bytes_per_file_byte = 64;

geometry::VoxelKey child_key(geometry::VoxelKey key, unsigned child, int level) {
  return {static_cast<std::uint16_t>(key.x | (child & 1) << level),
          static_cast<std::uint16_t>(key.y | (child >> 1 & 1) << level),
          static_cast<std::uint16_t>(key.z | (child >> 2 & 1) << level)};
}

/// OctoMap's .bt: two bits a child, in preorder; undivided where eight children are equal.
class BtWriter {
 public:
  explicit BtWriter(const occupancy::VoxelTree& tree) : tree_(tree) {}

  enum Kind : unsigned { unknown = 0, free = 1, occupied = 2, inner = 3 };

  /// Appends the subtree of `node`; nothing if it is uniform.
  Kind write(const occupancy::VoxelTree::Node& node) {
    ++nodes_;
    if (!node.has_children()) return tree_.occupied(node.log_odds()) ? occupied : free;
    const std::size_t start = bytes_.size(), nodes_before = nodes_;
    bytes_.append(2, '\0');
    unsigned bits = 0;
    for (unsigned c = 0; c < 8; ++c)
      if (const occupancy::VoxelTree::Node child = node.child(c); child.exists())
        bits |= write(child) << (2 * c);
    if (bits == all_free || bits == all_occupied) {
      bytes_.resize(start);
      nodes_ = nodes_before;
      return bits == all_free ? free : occupied;
    }
    bytes_[start] = static_cast<char>(bits & 0xff);
    bytes_[start + 1] = static_cast<char>(bits >> 8);
    return inner;
  }
  const std::string& bytes() const { return bytes_; }
  std::size_t nodes() const { return nodes_; }

 private:
  static constexpr unsigned all_free = 0x5555, all_occupied = 0xaaaa;
  const occupancy::VoxelTree& tree_;
  std::string bytes_;
  std::size_t nodes_ = 0;
};

class NodeWriter {
 public:
  explicit NodeWriter(const std::function<void(const std::string&)>& sink) : sink_(sink) {}

  void write(const occupancy::VoxelTree::Node& node) {
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
      if (mask >> c & 1) write(node.child(c));
  }
  void flush() {
    if (!chunk_.empty()) sink_(chunk_);
    chunk_.clear();
  }

 private:
  template <class T>
  void put(const T& value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    chunk_.append(bytes, sizeof value);
    if (chunk_.size() >= chunk_bytes) flush();
  }
  const std::function<void(const std::string&)>& sink_;
  std::string chunk_;
};

class NodeReader {
 public:
  NodeReader(occupancy::VoxelTree& tree, const std::function<std::string()>& source, const std::string& where)
      : tree_(tree), source_(source), where_(where) {}

  void read(geometry::VoxelKey corner, int level) {
    const auto mask = get<std::uint8_t>();
    if (mask == 0) return read_leaf(corner, level);
    if (level == 0) fail("the octree is deeper than 16 levels");
    if (level == occupancy::VoxelTree::brick_level) brick_ = &tree_.make_brick(corner);
    for (unsigned c = 0; c < 8; ++c)
      if (mask >> c & 1) read(child_key(corner, c, level - 1), level - 1);
  }
  bool at_end() {
    refill();
    return position_ == chunk_.size();
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::data, where_, "damaged octree: " + what, "restore the file from a backup");
  }

 private:
  void read_leaf(geometry::VoxelKey corner, int level) {
    const auto log_odds = get<float>();
    if (!std::isfinite(log_odds)) fail("a log-odds is not finite");
    // Most leaves are in bricks: descending from the root to each would take half of the time.
    if (level < occupancy::VoxelTree::brick_level)
      occupancy::VoxelTree::set_leaf(*brick_, corner, level, log_odds);
    else
      tree_.set_leaf(corner, level, log_odds);
    if (get<std::uint8_t>() == 0) return;
    const auto payload = get<occupancy::VoxelPayload>();
    if (!payload.has_point()) fail("a point has no distance class");
    if (level != 0 || !tree_.occupied(log_odds)) fail("a point stands in a voxel that cannot hold one");
    tree_.make_payload(corner) = payload;
  }
  void refill() {
    if (position_ < chunk_.size()) return;
    chunk_ = source_();
    position_ = 0;
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
    for (std::size_t done = 0; done < sizeof value;) {
      refill();
      if (chunk_.empty()) fail("it ends too early");
      const std::size_t n = std::min(sizeof value - done, chunk_.size() - position_);
      std::memcpy(bytes + done, chunk_.data() + position_, n);
      done += n;
      position_ += n;
    }
    return value;
  }
  occupancy::VoxelTree& tree_;
  const std::function<std::string()>& source_;
  const std::string& where_;
  std::string chunk_;
  std::size_t position_ = 0;
  occupancy::VoxelTree::Brick* brick_ = nullptr;  // current brick
};

/// Header of OctoMap's .bt and .ot: text lines up to "data", then bytes.
struct OctomapHeader {
  bool binary = false;
  std::string id;
  double resolution = 0;
  std::optional<std::size_t> nodes;
  std::size_t dropped = 0;  ///< .ot: bytes of a node after its log-odds
};

[[noreturn]] void refuse_octomap(const std::filesystem::path& file, const std::string& what) {
  throw Error(Error::Kind::data, file.string(), what, "expected an OctoMap .bt or .ot");
}

/// The next line of a header, of bounded length.
bool next_line(std::istream& in, std::string& line) {
  constexpr std::size_t longest = 4096;
  line.clear();
  for (int c = in.get(); c != std::istream::traits_type::eof() && line.size() < longest; c = in.get()) {
    if (c == '\n') return true;
    line.push_back(static_cast<char>(c));
  }
  return false;
}

/// The header of OctoMap's first .bt: a 3, resolution and size in binary.
std::optional<OctomapHeader> read_first_header(std::istream& in) {
  std::array<char, 4 + 8 + 4> bytes{};
  const auto begin = in.tellg();
  in.read(bytes.data(), bytes.size());
  std::int32_t type = 0;
  OctomapHeader header{true, "OcTree", 0, {}, 0};
  std::uint32_t nodes = 0;
  std::memcpy(&type, bytes.data(), sizeof type);
  std::memcpy(&header.resolution, bytes.data() + 4, sizeof header.resolution);
  std::memcpy(&nodes, bytes.data() + 12, sizeof nodes);
  header.nodes = nodes;
  if (in && type == 3) return header;
  in.clear();
  in.seekg(begin);
  return {};
}

bool begins_with(std::string text, std::string_view lower_case) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text.starts_with(lower_case);
}

/// Fields of a .ot's nodes beside log-odds, which come first. Other types than OctoMap's own (with time
/// stamps, labels) are known by the bytes that a node takes.
std::size_t dropped_bytes(const OctomapHeader& header, std::istream& in, const std::filesystem::path& file) {
  if (header.id == "OcTree") return 0;
  if (header.id == "ColorOcTree") return 3;
  std::error_code error;
  const auto left = std::filesystem::file_size(file, error) - static_cast<std::uintmax_t>(in.tellg());
  const std::size_t nodes = header.nodes.value_or(0);
  constexpr std::size_t least = sizeof(float) + 1;  // log-odds, children
  if (error || nodes == 0 || left % nodes != 0 || left / nodes < least)
    refuse_octomap(file, "holds a tree of type '" + header.id + "'");
  return left / nodes - least;
}

OctomapHeader read_header(std::istream& in, const std::filesystem::path& file) {
  if (!in) refuse_octomap(file, "cannot be opened");
  const auto usable = [&](const OctomapHeader& header) {
    if (!(header.resolution >= 1e-3 && header.resolution <= 10))
      refuse_octomap(file, "has no usable resolution");
    return header;
  };
  if (const auto first = read_first_header(in)) return usable(*first);
  OctomapHeader header;
  std::string line;
  if (!next_line(in, line)) refuse_octomap(file, line.empty() ? "is empty" : "is not an OctoMap file");
  if (begins_with(line, "# octomap octree binary file"))
    header.binary = true;
  else if (!begins_with(line, "# octomap octree file"))
    refuse_octomap(file, "is not an OctoMap file");
  for (int lines = 0; lines < 64 && next_line(in, line); ++lines) {
    if (line.ends_with('\r'))
      refuse_octomap(file, "was copied as text, which breaks it: its lines end in CR LF");
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "id") words >> header.id;
    if (word == "res") words >> header.resolution;
    if (std::size_t nodes = 0; word == "size" && words >> nodes) header.nodes = nodes;
    if (word == "data") {
      if (header.id == "CountingOcTree") refuse_octomap(file, "holds counts, not occupancy");
      if (header.id.empty() || header.id == "1") header.id = "OcTree";  // older names of it
      if (!header.binary && header.nodes != 0) header.dropped = dropped_bytes(header, in, file);
      return usable(header);
    }
  }
  refuse_octomap(file, "ends within its header");
}

class OctomapReader {
 public:
  OctomapReader(occupancy::VoxelTree& tree, std::istream& in, const OctomapHeader& header,
                const std::filesystem::path& file)
      : tree_(tree), in_(in), header_(header), file_(file) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (error) refuse_octomap(file, "cannot be read");
    most_bytes_ = free_bytes + bytes_per_file_byte * static_cast<std::size_t>(bytes);
  }

  void read() {
    ++nodes_;
    header_.binary ? read_binary({}, occupancy::VoxelTree::top_level)
                   : read_full({}, occupancy::VoxelTree::top_level);
    if (header_.nodes && *header_.nodes != nodes_)
      refuse_octomap(file_, "is damaged: " + std::to_string(nodes_) + " nodes where its header says " +
                                std::to_string(*header_.nodes));
    if (in_.get() != std::istream::traits_type::eof())
      refuse_octomap(file_, "is damaged: bytes are left over");
  }

 private:
  // .bt: two bits a child: 00 unknown, 01 free (low bit first), 10 occupied, 11 has children.
  void read_binary(geometry::VoxelKey corner, int level) {
    if (level == 0) refuse_octomap(file_, "is damaged: deeper than 16 levels");
    unsigned bits = byte();  // in two steps: | does not define the order of evaluation
    bits |= unsigned{byte()} << 8;
    if (bits == 0) set_leaf(corner, level, 0);  // OctoMap's value for an unset node
    for (unsigned c = 0; c < 8; ++c) {
      const unsigned kind = bits >> (2 * c) & 3;
      nodes_ += kind != 0;
      if (kind == 1 || kind == 2)
        set_leaf(child_key(corner, c, level - 1), level - 1,
                 kind == 1 ? tree_.model().clamp_min : tree_.model().clamp_max);
    }
    for (unsigned c = 0; c < 8; ++c)
      if ((bits >> (2 * c) & 3) == 3) read_binary(child_key(corner, c, level - 1), level - 1);
  }
  // .ot: log-odds and what is dropped, then a byte of child bits.
  void read_full(geometry::VoxelKey corner, int level) {
    float value = 0;
    for (std::size_t i = 0; i < sizeof value; ++i)
      reinterpret_cast<unsigned char*>(&value)[i] = byte() & 0xff;
    if (!std::isfinite(value)) refuse_octomap(file_, "is damaged: a log-odds is not finite");
    for (std::size_t i = 0; i < header_.dropped; ++i) byte();
    const unsigned mask = byte();
    if (mask == 0) set_leaf(corner, level, value);
    if (mask != 0 && level == 0) refuse_octomap(file_, "is damaged: deeper than 16 levels");
    nodes_ += geometry::bit_count(mask);
    for (unsigned c = 0; c < 8; ++c)
      if (mask >> c & 1) read_full(child_key(corner, c, level - 1), level - 1);
  }
  void set_leaf(geometry::VoxelKey corner, int level, float log_odds) {
    tree_.set_leaf(corner, level, log_odds);
    if (tree_.bytes() > most_bytes_)
      refuse_octomap(file_, "is damaged: it takes far more memory than its size allows");
  }
  unsigned char byte() {
    const int c = in_.get();
    if (c == std::istream::traits_type::eof()) refuse_octomap(file_, "is truncated");
    return static_cast<unsigned char>(c);
  }
  occupancy::VoxelTree& tree_;
  std::istream& in_;
  const OctomapHeader& header_;
  const std::filesystem::path& file_;
  std::size_t most_bytes_ = 0;
  std::size_t nodes_ = 0;
};

}  // namespace

void occupancy::OccupancyMap::write_bt(std::ostream& out) const {
  BtWriter writer(*tree_);
  if (!tree_->empty()) writer.write(tree_->root());
  out << "# Octomap OcTree binary file\n"
         "# (feel free to add / change comments, but leave the first line as it is!)\n#\nid OcTree\nsize "
      << writer.nodes() << "\nres " << grid_.resolution() << "\ndata\n";
  out.write(writer.bytes().data(), static_cast<std::streamsize>(writer.bytes().size()));
}

std::string OccupancyView::octomap_data() const {
  if (!tree_) return {};
  BtWriter writer(*tree_);
  if (!tree_->empty()) writer.write(tree_->root());
  return writer.bytes();
}

void occupancy::OccupancyMap::write_nodes(const std::function<void(const std::string&)>& sink) const {
  if (tree_->empty()) return;
  NodeWriter writer(sink);
  writer.write(tree_->root());
  writer.flush();
}

void occupancy::OccupancyMap::read_nodes(const std::function<std::string()>& source,
                                         const std::string& where) {
  *tree_ = occupancy::VoxelTree(tree_->model());
  NodeReader reader(*tree_, source, where);
  if (reader.at_end()) return;
  reader.read({}, occupancy::VoxelTree::top_level);
  if (!reader.at_end()) reader.fail("bytes are left over");
}

double read_octomap_resolution(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return read_header(in, file).resolution;
}

std::string octomap_note(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const OctomapHeader header = read_header(in, file);
  if (header.id == "OcTree") return {};
  return "octree: of type " + header.id + ", whose occupancy is taken" +
         (header.dropped > 0 ? ", and the " + std::to_string(header.dropped) +
                                   " bytes a node has besides (colour, time or labels) left"
                             : "");
}

occupancy::OccupancyMap occupancy::OccupancyMap::read_octomap(const std::filesystem::path& file,
                                                              OccupancyParameters parameters) {
  std::ifstream in(file, std::ios::binary);
  const OctomapHeader header = read_header(in, file);
  parameters.resolution = header.resolution;
  occupancy::OccupancyMap map(parameters);
  if (header.nodes == 0 && in.peek() == std::istream::traits_type::eof()) return map;  // an empty map
  if (in.peek() == std::istream::traits_type::eof()) refuse_octomap(file, "is truncated");
  OctomapReader(*map.tree_, in, header, file).read();
  return map;
}

}  // namespace octosurf
