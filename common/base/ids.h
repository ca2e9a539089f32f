// Identities on the wire: processes, frames, frames of reference and objects.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/time.h"

namespace perdure {

/// One start of one process; random, never 0 for a real process.
using InstanceId = std::uint64_t;
InstanceId makeInstanceId();

/// What people and programs call an object: the lowest id among the tracks that the map holds to be
/// one. Never reused within a map. 0 means "no object".
using ObjectId = std::uint64_t;
/// The filter's estimate of an object over one or more visits. Drawn by the filter, never changed.
using TrackId = std::uint64_t;

/// Which image a message is about: (source instance, sequence number) is its identity; the rest
/// is carried along so that no reader has to look it up.
struct FrameStamp {
  InstanceId source = 0;         ///< the capture process that made the frame
  std::uint64_t sequence = 0;    ///< index of the frame in the drive; goes on after a restart
  TimePoint time;                ///< middle of the exposure, sensor clock
  std::int64_t captured_ns = 0;  ///< CLOCK_MONOTONIC of capture's host when it was handed over

  bool sameFrame(const FrameStamp& other) const {
    return source == other.source && sequence == other.sequence;
  }
};

/// The frame of reference of poses. `world` lives as long as W does, restarts of vio included;
/// `epoch` goes up whenever W is lost and begun anew.
struct WorldId {
  std::uint64_t world = 0;
  std::uint32_t epoch = 0;
  auto operator<=>(const WorldId&) const = default;
};

/// 64-bit FNV-1a, for digests of configurations and models (not for security).
std::uint64_t digest(std::string_view bytes);
std::string toHex(std::uint64_t value);

}  // namespace perdure
