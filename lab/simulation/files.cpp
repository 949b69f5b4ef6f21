#include "simulation/files.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <regex>
#include <spng.h>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "binary PCD is written as it lies in memory");

Error not_written(const fs::path& file, const std::string& what = "cannot be written") {
  return Error(Error::Kind::output, file.string(), what, "check the folder's rights and the disk's room");
}

void write_bytes(const fs::path& file, const char* bytes, std::size_t count) {
  std::ofstream out(file, std::ios::binary);
  out.write(bytes, static_cast<std::streamsize>(count));
  out.close();
  if (!out) throw not_written(file);
}

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}

bool belongs_to_a_recording(const std::string& name) {
  static const std::regex pattern(R"(frame-\d{6,}\.(depth\.png|label\.png|pose\.txt)|scan-\d{6,}\.pcd|)"
                                  R"(poses\.txt|timestamps\.txt|camera-intrinsics\.txt|truth\.json)");
  return std::regex_match(name, pattern);
}

}  // namespace

void write_png(const fs::path& file, std::span<const std::uint16_t> pixels, std::size_t width) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(SPNG_CTX_ENCODER),
                                                                    spng_ctx_free);
  if (!context) throw std::bad_alloc();
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(pixels.size() / width);
  header.bit_depth = 16;
  header.color_type = SPNG_COLOR_TYPE_GRAYSCALE;
  // Millimetre noise hardly compresses; the fastest level without filters costs a third of the time.
  spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1);
  spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, 1);
  spng_set_option(context.get(), SPNG_FILTER_CHOICE, SPNG_DISABLE_FILTERING);
  int status = spng_set_ihdr(context.get(), &header);
  if (status == 0)
    status = spng_encode_image(context.get(), pixels.data(), pixels.size_bytes(), SPNG_FMT_PNG,
                               SPNG_ENCODE_FINALIZE);
  std::size_t size = 0;
  const std::unique_ptr<void, decltype(&std::free)> buffer(
      status == 0 ? spng_get_png_buffer(context.get(), &size, &status) : nullptr, std::free);
  if (!buffer) throw not_written(file, std::string("cannot be encoded: ") + spng_strerror(status));
  write_bytes(file, static_cast<const char*>(buffer.get()), size);
}

void write_pcd(const fs::path& file, const LabelledScan& labelled) {
  const auto& points = labelled.scan.points;
  const std::string count = std::to_string(points.size());
  const Eigen::Quaterniond q(labelled.scan.T_map_sensor.linear());
  const Eigen::Vector3d t = labelled.scan.T_map_sensor.translation();
  std::string viewpoint;
  for (const double value : {t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z()})
    viewpoint.append(" ").append(number(value));
  std::string bytes =
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 4\n"
      "TYPE F F F U\nCOUNT 1 1 1 1\nWIDTH " +
      count + "\nHEIGHT 1\nVIEWPOINT" + viewpoint + "\nPOINTS " + count + "\nDATA binary\n";
  const std::size_t header = bytes.size();
  bytes.resize(header + points.size() * 16);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t label = labelled.labels[i];
    std::memcpy(&bytes[header + i * 16], points[i].data(), 12);
    std::memcpy(&bytes[header + i * 16 + 12], &label, 4);
  }
  write_bytes(file, bytes.data(), bytes.size());
}

void write_text(const fs::path& file, const std::string& text) {
  write_bytes(file, text.data(), text.size());
}

std::string tum_pose(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  const auto& t = T.translation();
  std::string text = number(t.x());
  for (const double value : {t.y(), t.z(), q.x(), q.y(), q.z(), q.w()})
    text.append(" ").append(number(value));
  return text;
}

std::string matrix_pose(const Eigen::Isometry3d& T) {
  std::string text;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) text += number(T.matrix()(r, c)) + (c < 3 ? "\t" : "\n");
  return text;
}

void prepare_folder(const fs::path& dir, bool force) {
  std::error_code code;
  fs::create_directories(dir, code);
  if (!fs::is_directory(dir)) throw not_written(dir, "is not a folder and cannot be made one");
  if (fs::is_empty(dir, code) && !code) return;
  if (!force)
    throw Error(Error::Kind::usage, dir.string(), "is not empty",
                "choose another folder, or replace a recording in it with --force");
  for (const auto& entry : fs::directory_iterator(dir, code))
    if (belongs_to_a_recording(entry.path().filename().string())) fs::remove(entry.path(), code);
  if (code) throw not_written(dir, "cannot be cleared");
}

}  // namespace octosurf::simulation
