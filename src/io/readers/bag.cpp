#include "io/readers/bag.hpp"

#include "io/file_kind.hpp"
#include "io/readers/bounded_file.hpp"
#include "io/scan_list.hpp"

#include <algorithm>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<Bag> open_one(const fs::path& file) {
  BoundedFile bytes(file);
  const std::string head = bytes.take(std::min<std::uint64_t>(bytes.size(), 16));
  if (head.starts_with("\x89MCAP0\r\n")) return open_mcap(file);
  if (head.starts_with("SQLite format 3")) return open_sqlite_bag(file);
  if (head.starts_with("#ROSBAG V")) return open_ros1_bag(file);
  throw Error(
      Error::Kind::data, file.string(),
      bytes.size() == 0 ? "is empty" : "no bag: neither ROS 1's nor SQLite nor MCAP by its first bytes",
      "copy the bag again");
}

/// One recording in several files.
class JoinedBag : public Bag {
 public:
  explicit JoinedBag(std::vector<std::unique_ptr<Bag>> parts) : parts_(std::move(parts)) {}

  void read_all(const Visit& visit, std::vector<std::string>* left_out) override {
    for (std::size_t file = 0; file < parts_.size(); ++file) {
      std::vector<std::size_t> indices;
      const auto passed_on = [&](BagMessage message) {
        join(file, indices);
        message.topic = indices[message.topic];
        message.place.file = file;
        visit(message);
      };
      parts_[file]->read_all(passed_on, left_out);
      join(file, indices);
    }
  }

  std::string_view read(const MessagePlace& place) override { return parts_[place.file]->read(place); }

 private:
  /// Gives the part's topics their indices among all.
  void join(std::size_t file, std::vector<std::size_t>& indices) {
    const std::vector<BagTopic>& own = parts_[file]->topics();
    for (std::size_t i = indices.size(); i < own.size(); ++i) {
      const auto same = [&](const BagTopic& topic) {
        return topic.name == own[i].name && topic.type == own[i].type && topic.encoding == own[i].encoding;
      };
      const auto found = std::find_if(topics_.begin(), topics_.end(), same);
      indices.push_back(static_cast<std::size_t>(found - topics_.begin()));
      if (found == topics_.end()) topics_.push_back(own[i]);
    }
  }

  std::vector<std::unique_ptr<Bag>> parts_;
};

}  // namespace

std::unique_ptr<Bag> open_bag(const std::vector<fs::path>& files) {
  if (files.size() == 1) return open_one(files.front());
  std::vector<std::unique_ptr<Bag>> parts;
  for (const fs::path& file : files) parts.push_back(open_one(file));
  return std::make_unique<JoinedBag>(std::move(parts));
}

std::vector<fs::path> files_of_bag(const fs::path& input) {
  if (!fs::is_directory(input)) return {input};
  std::vector<fs::path> files;
  fs::path packed;
  for (const auto& entry : fs::directory_iterator(input)) {
    if (!entry.is_regular_file()) continue;
    if (kind_of(entry.path()) == FileKind::bag) files.push_back(entry.path());
    if (entry.path().extension() == ".zstd") packed = entry.path();
  }
  if (!packed.empty())
    throw Error(Error::Kind::data, packed.string(), "a bag that is compressed as a file",
                "unpack it first: zstd -d --rm " + packed.filename().string());
  if (files.empty())
    throw Error(Error::Kind::data, input.string(), "a bag's folder without .db3 or .mcap files");
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

bool is_bag(const fs::path& input) {
  std::error_code error;
  if (!fs::is_directory(input, error))
    return fs::is_regular_file(input, error) && kind_of(input) == FileKind::bag;
  return fs::is_regular_file(input / "metadata.yaml", error);
}

std::string ros_type(std::string_view type) {
  const auto middle = type.find("/msg/");
  if (middle == std::string_view::npos) return std::string(type);
  return std::string(type.substr(0, middle)) + "/" + std::string(type.substr(middle + 5));
}

}  // namespace octosurf
