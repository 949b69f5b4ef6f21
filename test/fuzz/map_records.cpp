
#include "fuzz/targets.hpp"
#include "map_file.pb.h"
#include "support/packed_map.hpp"

#include <algorithm>
#include <limits>
#include <random>

namespace octosurf::fuzz {
namespace {

using Random = std::minstd_rand;  // fixed: the fuzzer hands in the seed of each mutation

std::size_t below(Random& rng, std::size_t n) { return n == 0 ? 0 : rng() % n; }

/// Rings that are no rings: vertices twice, spikes, crossings, the other way round, rings cut in two or put
/// together.
void spoil_rings(map_file::Polygons& polygons, Random& rng) {
  auto& uv = *polygons.mutable_uv();
  const auto vertices = static_cast<std::size_t>(uv.size() / 2);
  if (vertices < 3) return;
  const auto at = [&](std::size_t vertex) { return uv.mutable_data() + 2 * (vertex % vertices); };
  const std::size_t a = below(rng, vertices);
  const std::size_t b = rng() % 2 == 0 ? a + 1 + below(rng, 3) : below(rng, vertices);
  switch (rng() % 6) {
    case 0:
      std::copy_n(at(b), 2, at(a));
      break;
    case 1:
      std::swap_ranges(at(a), at(a) + 2, at(b));
      break;
    case 2:  // a spike: there and back
      std::copy_n(at(a), 2, at(a + 2));
      break;
    case 3:
      at(a)[rng() % 2] += std::ldexp(static_cast<double>(rng() % 7) - 3, -static_cast<int>(rng() % 40));
      break;
    case 4:
      for (std::size_t i = 0; i < vertices / 2; ++i) std::swap_ranges(at(i), at(i) + 2, at(vertices - 1 - i));
      break;
    default: {  // the same vertices as other rings
      if (polygons.vertices_size() == 0) return;
      const int ring = static_cast<int>(below(rng, static_cast<std::size_t>(polygons.vertices_size())));
      const std::uint32_t n = polygons.vertices(ring);
      if (n < 6) return;
      polygons.set_vertices(ring, 3);
      polygons.add_vertices(n - 3);
      if (rng() % 2 == 0 || polygons.rings_size() == 0)
        polygons.add_rings(1);
      else
        polygons.set_rings(polygons.rings_size() - 1, polygons.rings(polygons.rings_size() - 1) + 1);
    }
  }
}

void spoil_number(google::protobuf::RepeatedField<double>& field, Random& rng) {
  if (field.empty()) return;
  double& value = *field.Mutable(static_cast<int>(below(rng, static_cast<std::size_t>(field.size()))));
  const double others[] = {0,
                           -value,
                           value * 1.001,
                           1e-300,
                           1e9,
                           std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(),
                           std::nextafter(value, 1e300)};
  value = others[rng() % std::size(others)];
}

bool spoil_surface(map_file::Record& record, Random& rng) {
  if (!record.has_surface()) return false;
  map_file::Surface& surface = *record.mutable_surface();
  google::protobuf::RepeatedField<double>* fields[] = {
      surface.mutable_plane(),     surface.mutable_pose(),    surface.mutable_hash_frame(),
      surface.mutable_reference(), surface.mutable_moments(), surface.mutable_evidence(),
      surface.mutable_covariance()};
  if (rng() % 4 != 0)
    for (std::size_t n = 1 + below(rng, 3); n > 0; --n) spoil_rings(*surface.mutable_polygons(), rng);
  else
    spoil_number(*fields[rng() % std::size(fields)], rng);
  if (rng() % 16 == 0) surface.set_polygons_stale(rng() % 2 == 0);
  return true;
}

}  // namespace

std::string mutated_map(std::string_view file, unsigned seed,
                        const std::function<void(std::string&)>& mutate) {
  Random rng(seed);
  std::vector<std::string> records = test::records_of(file);
  if (records.empty() || rng() % 16 == 0) {
    std::string bytes(file);
    mutate(bytes);
    return bytes;
  }
  std::string& one = records[below(rng, records.size())];
  map_file::Record record;
  if (rng() % 3 != 0 && record.ParseFromString(one) && spoil_surface(record, rng)) {
    one = record.SerializeAsString();
  } else if (rng() % 16 == 0) {
    const std::string copy = one;
    records.insert(records.begin() + static_cast<std::ptrdiff_t>(below(rng, records.size())), copy);
  } else {
    // Only the content: a wrong tag or length is refused at once.
    const std::size_t head = std::min<std::size_t>(one.size(), one.size() < 130     ? 2
                                                               : one.size() < 16388 ? 3
                                                                                    : 4);
    map_file::Record key;
    if (record.ParseFromString(one)) key.set_key(record.key());
    const std::string end = key.SerializeAsString();
    std::string content = one.substr(head, one.size() - std::min(one.size(), head + end.size()));
    mutate(content);
    const auto tag = static_cast<char>(one.empty() ? 0 : one[0]);
    std::string length;
    std::size_t rest = content.size();
    for (; rest >= 128; rest >>= 7) length.push_back(static_cast<char>(rest | 128));
    length.push_back(static_cast<char>(rest));
    one = tag + length + content + end;
  }
  return test::map_file_of(records);
}

}  // namespace octosurf::fuzz
