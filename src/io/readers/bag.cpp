#include "io/readers/bag.hpp"

#include "io/readers/bounded_file.hpp"
#include "io/readers/file_kind.hpp"
#include "io/readers/scan_list.hpp"

#include <algorithm>

#include <octosurf/error.hpp>

namespace octosurf::io {
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

/// "walk_0.db3.zstd"
bool is_packed(const fs::path& file) {
  const std::string ending = file.stem().extension().string();
  return file.extension() == ".zstd" && (ending == ".db3" || ending == ".mcap") &&
         kind_of(file) == FileKind::unknown;
}

void require_unpacked(const fs::path& file) {
  if (is_packed(file) && !fs::exists(fs::path(file).replace_extension()))
    throw Error(Error::Kind::data, file.string(), "a bag that is compressed as a file",
                "unpack it first: zstd -d --rm " + file.filename().string());
}

/// One recording in several files.
class JoinedBag : public Bag {
 public:
  explicit JoinedBag(const std::vector<fs::path>& files) : files_(files) {
    for (const fs::path& file : files_) parts_.push_back(open_one(file));
  }

  void read_messages(const Visit& visit, std::vector<std::string>* left_out) override {
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
  /// Maps the part's topics to their indices in the whole.
  void join(std::size_t file, std::vector<std::size_t>& indices) {
    const std::vector<BagTopic>& own = parts_[file]->topics();
    for (std::size_t i = indices.size(); i < own.size(); ++i)
      indices.push_back(topic_index(own[i], files_[file]));
  }

  std::vector<fs::path> files_;
  std::vector<std::unique_ptr<Bag>> parts_;
};

}  // namespace

std::unique_ptr<Bag> open_bag(const std::vector<fs::path>& files) {
  if (files.size() == 1) return open_one(files.front());
  return std::make_unique<JoinedBag>(files);
}

std::vector<fs::path> files_of_bag(const fs::path& input) {
  std::vector<fs::path> files;
  if (!fs::is_directory(input)) {
    require_unpacked(input);
    return {input};
  }
  for (const auto& entry : fs::directory_iterator(input)) {
    if (!entry.is_regular_file() || is_hidden(entry.path())) continue;
    if (kind_of(entry.path()) == FileKind::bag) files.push_back(entry.path());
    require_unpacked(entry.path());
  }
  std::ranges::sort(files, natural_less, [](const fs::path& file) { return file.filename().string(); });
  return files;
}

bool is_bag(const fs::path& input) {
  std::error_code error;
  if (!fs::is_directory(input, error))
    return fs::is_regular_file(input, error) && (kind_of(input) == FileKind::bag || is_packed(input));
  if (!fs::is_regular_file(input / "metadata.yaml", error)) return false;
  const auto entries = fs::directory_iterator(input, error);
  return std::any_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    return kind_of(entry.path()) == FileKind::bag || is_packed(entry.path());
  });
}

void Bag::read_all(const Visit& visit, std::vector<std::string>* left_out) try {
  read_messages(visit, left_out);
} catch (const Error& error) {
  if (!left_out) throw;
  left_out->push_back(std::string(error.what()) + "; what follows is left out");
}

std::size_t Bag::topic_index(const BagTopic& topic, const fs::path& where) {
  constexpr std::size_t most = 1 << 16;
  const auto [found, is_new] = topic_indices_.emplace(topic, topics_.size());
  if (is_new && topics_.size() == most) {
    topic_indices_.erase(found);
    throw Error(Error::Kind::data, where.string(), "a damaged bag: more than 65536 topics", "copy it again");
  }
  if (is_new) topics_.push_back(topic);
  return found->second;
}

std::string ros_type(std::string_view type) {
  const auto middle = type.find("/msg/");
  if (middle == std::string_view::npos) return std::string(type);
  return std::string(type.substr(0, middle)) + "/" + std::string(type.substr(middle + 5));
}

}  // namespace octosurf::io
