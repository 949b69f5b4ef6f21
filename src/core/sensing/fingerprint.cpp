#include "sensing/fingerprint.hpp"

#include <bit>
#include <boost/crc.hpp>
#include <cstddef>

namespace octosurf::sensing {
namespace {

constexpr std::size_t most_points = 4096;  // effort: even a few points are unique by their noise

/// CRC-64/XZ. Numbers are added lowest byte first on every machine.
class Checksum {
 public:
  template <std::unsigned_integral Number>
  void add(Number number) {
    for (std::size_t byte = 0; byte < sizeof(Number); ++byte)
      crc_.process_byte(static_cast<unsigned char>(number >> (8 * byte)));
  }
  std::uint64_t value() const { return crc_.checksum(); }

 private:
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693, ~std::uint64_t{0}, ~std::uint64_t{0}, true, true> crc_;
};

}  // namespace

std::uint64_t fingerprint_of(const Scan& scan) {
  Checksum checksum;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      checksum.add(std::bit_cast<std::uint64_t>(scan.T_map_sensor(row, column)));
  checksum.add(std::uint64_t{scan.points.size()});
  const std::size_t step = 1 + scan.points.size() / most_points;
  for (std::size_t i = 0; i < scan.points.size(); i += step)
    for (const float coordinate : {scan.points[i].x(), scan.points[i].y(), scan.points[i].z()})
      checksum.add(std::bit_cast<std::uint32_t>(coordinate));
  return checksum.value();
}

}  // namespace octosurf::sensing
