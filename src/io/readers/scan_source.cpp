#include "io/readers/file_kind.hpp"
#include "io/readers/recording.hpp"

#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

/// Reads a recording's scans one after the other.
class FileScanSource : public ScanSource {
 public:
  FileScanSource(io::Recording recording, bool skip_bad)
      : recording_(std::move(recording)), skip_bad_(skip_bad), skipped_(recording_.left_out()) {}

  std::size_t size() const override { return recording_.size(); }
  const std::vector<std::string>& skipped() const override { return skipped_; }
  Eigen::Vector3d origin() const override { return recording_.origin(); }
  std::vector<std::string> notes() const override { return recording_.notes(); }
  bool posed_elsewhere() const override { return recording_.posed_elsewhere(); }

  std::optional<Scan> next() override {
    while (at_ < size()) {
      try {
        Scan scan = recording_.read(at_++);
        ++good_;
        return scan;
      } catch (const Error& error) {
        if (!skip_bad_ || error.kind() != Error::Kind::data) throw;
        skipped_.push_back(error.what());
      }
    }
    if (skip_bad_ && std::exchange(good_, 1) == 0)
      throw Error(Error::Kind::data, "", "none of the " + std::to_string(size()) + " scans is good",
                  "the last one: " + skipped_.back());
    return std::nullopt;
  }

  bool skip(std::size_t count) override {
    if (skip_bad_) return ScanSource::skip(count);
    const bool enough = count <= size() - at_;
    at_ = enough ? at_ + count : size();
    return enough;
  }

 private:
  io::Recording recording_;
  bool skip_bad_;
  std::size_t at_ = 0, good_ = 0;
  std::vector<std::string> skipped_;
};

}  // namespace

bool is_occupancy_map(const fs::path& input) {
  std::error_code error;
  const auto status = fs::status(input, error);
  if (!fs::exists(status)) throw Error(Error::Kind::data, input.string(), "no such file or folder");
  if (fs::is_directory(status)) return false;
  const io::FileKind kind = fs::is_regular_file(status) ? io::kind_of(input) : io::FileKind::unknown;
  if (kind != io::FileKind::unknown) return kind == io::FileKind::occupancy_map;
  if (input.extension() == ".surfaces")
    throw Error(Error::Kind::data, input.string(), "a saved map, not scans", "resume it by --resume");
  throw Error(Error::Kind::data, input.string(), "not a kind of file that is read",
              "give depth images (PNG, PGM), clouds (PCD, PLY, velodyne .bin), a bag (.bag, .db3, .mcap), a "
              ".graph, .bt or .ot");
}

std::unique_ptr<ScanSource> open_scans(const std::vector<fs::path>& inputs,
                                       const ScanSourceOptions& options) try {
  return std::make_unique<FileScanSource>(io::Recording(inputs, options), options.skip_bad);
} catch (const fs::filesystem_error& error) {
  throw Error(Error::Kind::data, error.path1().string(), error.code().message());
}

}  // namespace octosurf
