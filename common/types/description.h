// Descriptions of messages. Each header of this folder lists, after its structs, their fields by
// name and kind with their limits. Encoding, decoding, JSON and Python use these descriptions. In
// describe(a, d, w), `a` is the archive, `d` the domain value, and `w` the value on the wire
// (idl/). The IDL states no bounds; they are checked here, so that refusals can be counted.
#pragma once

#include <concepts>
#include <cstddef>
#include <type_traits>

#include "common/base/ids.h"
#include "common/base/time.h"

namespace perdure::wire {

struct Limits {
  double low, high;
};

inline constexpr Limits kProbability{0.0, 1.0};
inline constexpr Limits kCoordinate{-1e8, 1e8};     ///< metres in W
inline constexpr Limits kPixel{-1e6, 1e6};          ///< boxes may lie outside the image
inline constexpr Limits kAngle{-1e3, 1e3};          ///< radians, not necessarily wrapped
inline constexpr Limits kAngularRate{-1e3, 1e3};    ///< rad/s
inline constexpr Limits kAcceleration{-1e5, 1e5};   ///< m/s²
inline constexpr Limits kSpeed{-1e5, 1e5};          ///< m/s
inline constexpr Limits kMatrixEntry{-1e12, 1e12};  ///< covariances, transitions
inline constexpr Limits kLogit{-1e6, 1e6};
inline constexpr Limits kInputScale{0.0, 1.0};  ///< 0: not known
inline constexpr Limits kNats{-1e9, 1e9};       ///< sums of evidence
inline constexpr Limits kNotNegative{0.0, 1e18};
inline constexpr Limits kInset{-0.45, 0.45};  // inset of a box, per side
inline constexpr Limits kPositive{1e-12, 1e12};
inline constexpr Limits kLatitudeDeg{-90.0, 90.0};
inline constexpr Limits kLongitudeDeg{-360.0, 360.0};
inline constexpr Limits kOffset{-1e3, 1e3};  ///< seconds

inline constexpr std::size_t kNameLength = 256;    ///< bytes: cameras, classes, processes, reasons
inline constexpr std::size_t kTextLength = 16384;  ///< bytes: messages, details
inline constexpr std::size_t kImageSide = 16384;   ///< pixels
inline constexpr std::size_t kImageBytes = 256u << 20;
inline constexpr std::size_t kCameras = 16;
inline constexpr std::size_t kCoefficients = 8;
inline constexpr std::size_t kClasses = 8192;
inline constexpr std::size_t kDetections =
    1024;  ///< inference sends at most 512; each costs the filter 0.8 ms
inline constexpr std::size_t kLandmarks = 65536;
inline constexpr std::size_t kObjects = 16384;
inline constexpr std::size_t kReplyObjects = 100000;
inline constexpr std::size_t kReplyAnchors = 65536;  ///< also the largest number of loops
inline constexpr std::size_t kReasons = 1024;
inline constexpr std::size_t kEvidenceKinds = 64;
/// Tolerance of the norm of a quaternion or a unit vector, and of the sum of a PMF.
inline constexpr double kUnitTolerance = 1e-3;

template <class D, class T>
concept Is = std::same_as<std::remove_cv_t<D>, T>;

void describe(auto& a, Is<FrameStamp> auto& d, auto& w) {
  a.value("source", d.source, w.source);
  a.value("sequence", d.sequence, w.seq);
  a.time("time_ns", d.time, w.time_ns);
  a.value("captured_ns", d.captured_ns, w.captured_ns);
  a.ensure("captured_ns", "out_of_range", [&] { return isTime(d.captured_ns); });
}

void describe(auto& a, Is<WorldId> auto& d, auto& w) {
  a.value("world", d.world, w.world);
  a.value("epoch", d.epoch, w.epoch);
}

}  // namespace perdure::wire
