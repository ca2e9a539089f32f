// Identifiers on the wire: of processes, images, frames of reference and objects.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/time.h"

namespace perdure {

/// Identifies one run of a process. The value is random, and never 0 for a real process.
using InstanceId = std::uint64_t;
InstanceId makeInstanceId();

/// The public id of an object: the lowest id of the tracks that the map considers one object. It is
/// never reused within a map. 0 means "no object".
using ObjectId = std::uint64_t;
/// Identifies a track: the filter's estimate of an object over one or more visits. The id never
/// changes.
using TrackId = std::uint64_t;

/// Identifies the image of a message by source instance and sequence number. The times are copies,
/// so that readers need not look them up.
struct FrameStamp {
  InstanceId source = 0;         ///< the capture process that made the frame
  std::uint64_t sequence = 0;    ///< index of the frame in the drive; continues after a restart
  TimePoint time;                ///< middle of the exposure, sensor clock
  std::int64_t captured_ns = 0;  ///< CLOCK_MONOTONIC of capture's host when the frame was passed on

  bool sameFrame(const FrameStamp& other) const {
    return source == other.source && sequence == other.sequence;
  }
};

/// Identifies the odometry world W in which poses are given. `world` does not change while W is
/// valid, even if vio is restarted. `epoch` increases whenever W is lost and begins again.
struct WorldId {
  std::uint64_t world = 0;
  std::uint32_t epoch = 0;
  auto operator<=>(const WorldId&) const = default;
};

/// Returns the 64-bit FNV-1a digest, for configurations and models (not for security).
std::uint64_t digest(std::string_view bytes);
std::string toHex(std::uint64_t value);

}  // namespace perdure
