// Identifies a session in any map by digests of its first anchors, because ids and numbers of
// worlds are not unique across vehicles.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"

namespace perdure::mapping {

/// Digests of a session's first anchor and of its first two anchors. `second` is 0 if there is only
/// one anchor.
struct SessionIdentity {
  std::uint64_t first = 0, second = 0;
  auto operator<=>(const SessionIdentity&) const = default;

  /// Returns true for the same session, even if one map has only the session's first anchor.
  bool matches(const SessionIdentity& other) const {
    return first == other.first && (second == other.second || second == 0 || other.second == 0);
  }
};

struct Session {
  WorldId world;
  SessionIdentity identity;
  std::vector<AnchorId> anchors;  ///< ordered, not empty
};

/// Returns the sessions of the map by the ids of their first anchors, so the oldest comes first.
std::vector<Session> sessionsOf(const SavedMap& map);

/// The session with this identity, or null.
const Session* find(const std::vector<Session>& sessions, const SessionIdentity& identity);

}  // namespace perdure::mapping
