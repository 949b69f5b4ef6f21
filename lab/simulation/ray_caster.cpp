#include "simulation/ray_caster.hpp"

// Embree 3 (Debian 12, Ubuntu 22.04) or 4 (Debian 13, Ubuntu 24.04), whichever cmake/dependencies.cmake
// finds; its only include in the code, for the two differ in where a ray's context is.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <algorithm>
#include <array>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

/// Finds the first hit of each ray; quicker if neighbouring rays are alike.
void intersect(RTCScene scene, std::span<RTCRayHit> rays) {
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  for (RTCRayHit& ray : rays) rtcIntersect1(scene, &ray, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect1M(scene, &context, rays.data(), static_cast<unsigned>(rays.size()), sizeof(RTCRayHit));
#endif
}

}  // namespace

struct RayCaster::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<std::uint32_t> facet_of_triangle;

  ~Impl() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

RayCaster::RayCaster(const Scene& scene, const Similarity& T_map_scene, int phase)
    : impl_(std::make_unique<Impl>()) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<unsigned, 3>> triangles;
  std::uint32_t facet_index = 0;
  for (const auto& solid : scene.solids)
    for (const auto& facet : solid.facets) {
      const std::uint32_t index = facet_index++;
      if (!scene.objects[solid.object].stands[phase]) continue;
      const auto first = static_cast<unsigned>(vertices.size());
      for (const auto& vertex : facet.ring) vertices.push_back((T_map_scene * vertex).cast<float>());
      for (unsigned i = 2; i < facet.ring.size(); ++i) {
        triangles.push_back({first, first + i - 1, first + i});
        impl_->facet_of_triangle.push_back(index);
      }
    }

  // One thread: the tree, and with it ties on shared edges, must not depend on the machine's cores.
  impl_->device = rtcNewDevice("threads=1,user_threads=1");
  if (!impl_->device) throw Error(Error::Kind::data, "Embree", "cannot start", "check that the CPU has SSE2");
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertex_buffer = static_cast<Eigen::Vector3f*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Eigen::Vector3f),
                              std::max<std::size_t>(vertices.size(), 1)));
  auto* index_buffer = static_cast<std::array<unsigned, 3>*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              sizeof(std::array<unsigned, 3>), std::max<std::size_t>(triangles.size(), 1)));
  if (!vertex_buffer || !index_buffer) {
    rtcReleaseGeometry(geometry);
    throw std::bad_alloc();
  }
  std::copy(vertices.begin(), vertices.end(), vertex_buffer);
  std::copy(triangles.begin(), triangles.end(), index_buffer);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(impl_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(impl_->scene);
}

RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster::~RayCaster() = default;

std::vector<Hit> RayCaster::cast(const Eigen::Vector3d& origin, std::span<const Eigen::Vector3f> directions,
                                 double reach) const {
  constexpr std::size_t batch = 1024;  // rays at a time; stays in the second-level cache
  std::vector<Hit> hits(directions.size());
  std::vector<RTCRayHit> rays(std::min(batch, directions.size()));
  const Eigen::Vector3f o = origin.cast<float>();
  for (std::size_t begin = 0; begin < directions.size(); begin += batch) {
    const std::size_t count = std::min(batch, directions.size() - begin);
    for (std::size_t i = 0; i < count; ++i) {
      const auto& d = directions[begin + i];
      rays[i].ray = {o.x(), o.y(), o.z(), 0, d.x(), d.y(), d.z(), 0, static_cast<float>(reach), ~0u, 0, 0};
      rays[i].hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rays[i].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    }
    intersect(impl_->scene, std::span(rays).first(count));
    for (std::size_t i = 0; i < count; ++i)
      if (rays[i].hit.geomID != RTC_INVALID_GEOMETRY_ID)
        hits[begin + i] = {rays[i].ray.tfar, impl_->facet_of_triangle[rays[i].hit.primID]};
  }
  return hits;
}

}  // namespace octosurf::simulation
