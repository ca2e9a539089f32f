// What a session is known by in any map: its first anchors, bit for bit. Numbers of worlds and ids
// of different vehicles are the same ones.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"

namespace perdure::mapping {

/// Digests of a session's first anchor, and of its first two; `second` is 0 while there is one.
struct SessionIdentity {
  std::uint64_t first = 0, second = 0;
  auto operator<=>(const SessionIdentity&) const = default;

  /// The same session, of which one map may know one anchor only.
  bool matches(const SessionIdentity& other) const {
    return first == other.first && (second == other.second || second == 0 || other.second == 0);
  }
};

struct Session {
  WorldId world;
  SessionIdentity identity;
  std::vector<AnchorId> anchors;  ///< in order, not empty
};

/// By their first anchors: the oldest session of the map comes first.
std::vector<Session> sessionsOf(const SavedMap& map);

/// That of `sessions` with this identity, or null.
const Session* find(const std::vector<Session>& sessions, const SessionIdentity& identity);

}  // namespace perdure::mapping
