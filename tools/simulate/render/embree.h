// Hides the different query options of Embree 3 (Debian 12) and 4 (Debian 13).
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace perdure::tools {

#if RTC_VERSION_MAJOR >= 4

/// Finds nearest hits. The rays of a packet must have similar origins and directions.
inline void intersectCoherent(const int* valid, RTCScene scene, RTCRayHit8& rays) {
  RTCIntersectArguments options;
  rtcInitIntersectArguments(&options);
  options.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &rays, &options);
}
inline void occludedCoherent(const int* valid, RTCScene scene, RTCRay8& rays) {
  RTCOccludedArguments options;
  rtcInitOccludedArguments(&options);
  options.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &rays, &options);
}

#else

inline RTCIntersectContext coherentRays() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}
/// Finds nearest hits. The rays of a packet must have similar origins and directions.
inline void intersectCoherent(const int* valid, RTCScene scene, RTCRayHit8& rays) {
  RTCIntersectContext context = coherentRays();
  rtcIntersect8(valid, scene, &context, &rays);
}
inline void occludedCoherent(const int* valid, RTCScene scene, RTCRay8& rays) {
  RTCIntersectContext context = coherentRays();
  rtcOccluded8(valid, scene, &context, &rays);
}

#endif

}  // namespace perdure::tools
