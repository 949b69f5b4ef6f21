#pragma once

#include <compare>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/ros_messages.hpp>

namespace octosurf::io {

struct BagTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/PointCloud2", in ROS 2's bags too (sensor_msgs/msg/PointCloud2 there)
  MessageEncoding encoding = MessageEncoding::other;
  auto operator<=>(const BagTopic&) const = default;
};

/// Location of a message; meaningful only to its bag.
struct MessagePlace {
  std::uint64_t block = 0;  ///< a chunk or a row
  std::uint64_t offset = 0, size = 0;
  std::size_t file = 0;  ///< of a bag in several files
};

struct BagMessage {
  std::size_t topic = 0;       ///< index into topics()
  std::int64_t logged_ns = 0;  ///< when it was recorded, since 1970
  std::string_view bytes;      ///< valid during the visit
  MessagePlace place;
};

/// A recording of messages: ROS 1 (format 2.0) or ROS 2 (SQLite, MCAP), read sequentially without indexes, so
/// up to where its recorder was killed. Memory is bounded by the size of the file, whatever its headers
/// claim.
class Bag {
 public:
  using Visit = std::function<void(const BagMessage&)>;

  Bag() = default;
  Bag(const Bag&) = delete;
  Bag& operator=(const Bag&) = delete;
  virtual ~Bag() = default;

  /// Visits every message in the order of the file. Throws Error(data) where the bag is damaged; with
  /// `left_out`, skips damaged parts and adds a line for each.
  void read_all(const Visit& visit, std::vector<std::string>* left_out);

  /// The bytes of a visited message; valid until the next read.
  virtual std::string_view read(const MessagePlace& place) = 0;

  /// All topics once the bag was read, those of the messages visited so far before that.
  const std::vector<BagTopic>& topics() const { return topics_; }

 protected:
  /// As read_all(), but an Error ends the reading.
  virtual void read_messages(const Visit& visit, std::vector<std::string>* left_out) = 0;

  /// Several publishers, channels or files may share a topic. Throws Error(data) naming `where` for more
  /// topics than MCAP has numbers for.
  std::size_t topic_index(const BagTopic& topic, const std::filesystem::path& where);

 private:
  std::vector<BagTopic> topics_;
  std::map<BagTopic, std::size_t> topic_indices_;
};

/// Opens several files of one recording; topics of equal name and type are joined. Throws Error(data) for a
/// file that is no bag, or of a kind that this build does not support.
std::unique_ptr<Bag> open_bag(const std::vector<std::filesystem::path>& files);

/// The files of a bag: the file itself, or those in a folder, in natural order. Throws Error(data) if some
/// are compressed as files.
std::vector<std::filesystem::path> files_of_bag(const std::filesystem::path& input);

/// True for a bag file by its content or, if damaged, by its extension, and for the folder of a ROS 2 bag:
/// with metadata.yaml and such files.
bool is_bag(const std::filesystem::path& input);

/// In bytes, with the log that SQLite has beside it.
std::uint64_t size_of_bag_file(const std::filesystem::path& file);

/// "sensor_msgs/msg/Image" without its "msg/".
std::string ros_type(std::string_view type);

// One file each; used by `open_bag`.
std::unique_ptr<Bag> open_mcap(const std::filesystem::path& file);
std::unique_ptr<Bag> open_sqlite_bag(const std::filesystem::path& file);
std::unique_ptr<Bag> open_ros1_bag(const std::filesystem::path& file);

}  // namespace octosurf::io
