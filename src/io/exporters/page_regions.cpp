#include "io/exporters/export_formats.hpp"
#include "io/exporters/page_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include <octosurf/contact.hpp>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

/// A region's rings in the block's arrays; how many vertices each has: [[outer, hole, …], …].
class RegionRings {
 public:
  Json add(const ContactRegion& region) {
    Json polygons = Json::array();
    for (const Polygon& polygon : region.polygons) {
      Json sizes = Json::array({add(polygon.outer, region.surface)});
      for (const Ring2& hole : polygon.holes) sizes.push_back(add(hole, region.surface));
      polygons.push_back(std::move(sizes));
    }
    return polygons;
  }

  void write(PageBlock& block) const {
    block.add("region_u", differences(u_));
    block.add("region_v", differences(v_));
  }

 private:
  std::size_t add(const Ring2& ring, SurfaceId id) {
    for (const Eigen::Vector2d& uv : ring) {
      u_.push_back(page_polygon_steps(uv.x(), id));
      v_.push_back(page_polygon_steps(uv.y(), id));
    }
    return ring.size();
  }

  std::vector<std::int32_t> u_, v_;
};

Json refusals_json(const ContactRegion& region) {
  Json names = Json::array();
  for (const ContactRefusal refusal : region.refused) names.push_back(contact_refusal_name(refusal));
  return names;
}

}  // namespace

void add_feet(PageBlock& block, const PageMap& map) {
  RegionRings rings;
  Json feet = Json::array();
  for (const PageFoot& foot : map.feet) {
    Json regions = Json::array();
    for (const ContactRegion& region : foot.regions) {
      if (map.snapshot->find(region.surface) == nullptr)
        throw Error(Error::Kind::data, "foot " + foot.name,
                    "has a region on surface " + std::to_string(region.surface) + ", which the map has not",
                    "give regions of this snapshot");
      regions.push_back({{"surface", region.surface},
                         {"area_m2", finite(region.area_m2, region.surface)},
                         {"refused", refusals_json(region)},
                         {"rings", rings.add(region)}});
    }
    feet.push_back({{"name", foot.name}, {"regions", std::move(regions)}});
  }
  block.json["feet"] = std::move(feet);
  rings.write(block);
}

}  // namespace octosurf::io
