// Words that represent values of enumerations in Python; an enumeration without words is an int.
#pragma once

#include <array>
#include <string_view>

#include "common/types/health.h"
#include "common/types/map_graph.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::python {

template <class E>
inline constexpr std::array<std::string_view, 0> kWords{};
template <>
inline constexpr std::array<std::string_view, 3> kWords<OdometryState>{"initialising", "tracking",
                                                                       "degraded"};
template <>
inline constexpr std::array<std::string_view, 4> kWords<HealthState>{"starting", "ok", "degraded",
                                                                     "failed"};
template <>
inline constexpr std::array<std::string_view, 4> kWords<ImageEncoding>{"mono8", "bgr8",
                                                                       "jpeg_mono8", "jpeg_bgr8"};
template <>
inline constexpr std::array<std::string_view, 4> kWords<DistortionModel>{
    "none", "radial_tangential", "equidistant", "rational"};
template <>
inline constexpr std::array<std::string_view, 3> kWords<BoxExtent>{"cuboid", "outline", "unknown"};
template <>
inline constexpr std::array<std::string_view, 2> kWords<Memory>{"working", "long_term"};
template <>
inline constexpr std::array<std::string_view, 8> kWords<MapQueryKind>{
    "by_id", "by_class", "by_radius", "by_box", "all", "restore", "recall", "graph"};
template <>
inline constexpr std::array<std::string_view, 2> kWords<MapLoopKind>{"loop", "tie"};

/// Returns the word of a value, for example "visible"; empty if it has no word.
template <class E>
std::string_view wordOf(E value) {
  const auto place = static_cast<std::size_t>(value);
  if constexpr (requires { nameOf(value); }) return nameOf(value);
  return place < kWords<E>.size() ? kWords<E>[place] : std::string_view();
}

}  // namespace perdure::python
