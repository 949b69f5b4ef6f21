#include "io/readers/scan_files.hpp"

#include <spng.h>

namespace octosurf::test {
namespace {

std::string encode_png(int width, int height, int bits, int colour, const void* pixels, std::size_t bytes) {
  spng_ctx* context = spng_ctx_new(SPNG_CTX_ENCODER);
  spng_set_option(context, SPNG_ENCODE_TO_BUFFER, 1);
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = static_cast<std::uint8_t>(bits);
  header.color_type = static_cast<std::uint8_t>(colour);
  spng_set_ihdr(context, &header);
  EXPECT_EQ(spng_encode_image(context, pixels, bytes, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE), 0);
  std::size_t size = 0;
  int error = 0;
  void* buffer = spng_get_png_buffer(context, &size, &error);
  std::string png(static_cast<const char*>(buffer), size);
  free(buffer);
  spng_ctx_free(context);
  return png;
}

}  // namespace

fs::path ScanFiles::write(const std::string& name, std::string_view content) const {
  const fs::path file = folder / name;
  fs::create_directories(file.parent_path());
  write_file(file, content);
  return file;
}

fs::path ScanFiles::write_png(const std::string& name, int width, int height,
                              const std::vector<std::uint16_t>& pixels) const {
  return write(name,
               encode_png(width, height, 16, SPNG_COLOR_TYPE_GRAYSCALE, pixels.data(), 2 * pixels.size()));
}

fs::path ScanFiles::write_picture(const std::string& name, bool colour) const {
  const std::string pixels(colour ? 6 : 2, 'x');
  return write(name, encode_png(2, 1, 8, colour ? SPNG_COLOR_TYPE_TRUECOLOR : SPNG_COLOR_TYPE_GRAYSCALE,
                                pixels.data(), pixels.size()));
}

fs::path ScanFiles::write_pcd(const std::string& name, const std::string& viewpoint) const {
  return write(name,
               "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\n"
               "HEIGHT 1\nVIEWPOINT " +
                   viewpoint + "\nPOINTS 3\nDATA ascii\n1 2 3\n4 5 6\nnan nan nan\n");
}

std::vector<Scan> read_all(ScanSource& source) {
  std::vector<Scan> scans;
  while (auto scan = source.next()) scans.push_back(std::move(*scan));
  return scans;
}

std::vector<Scan> read_all(const std::vector<fs::path>& inputs, const ScanSourceOptions& options) {
  return read_all(*open_scans(inputs, options));
}

std::vector<double> stamps(const std::vector<Scan>& scans) {
  std::vector<double> all;
  for (const Scan& scan : scans) all.push_back(scan.stamp_s);
  return all;
}

std::vector<double> places(const std::vector<Scan>& scans) {
  std::vector<double> all;
  for (const Scan& scan : scans) all.push_back(scan.T_map_sensor.translation().x());
  return all;
}

std::string failure(const std::vector<fs::path>& inputs, const ScanSourceOptions& options) {
  return failure(Error::Kind::data, [&] { read_all(inputs, options); });
}

}  // namespace octosurf::test
