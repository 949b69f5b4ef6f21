#pragma once

// Embree 3 (Debian 12, Ubuntu 22.04) or 4 (Debian 13, Ubuntu 24.04), whichever cmake/dependencies.cmake
// finds; its only include in the code, for the two differ in where a ray's context is.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <span>

namespace octosurf {

/// Finds the first hit of each ray; quicker if neighbouring rays are alike.
inline void intersect(RTCScene scene, std::span<RTCRayHit> rays) {
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

}  // namespace octosurf
