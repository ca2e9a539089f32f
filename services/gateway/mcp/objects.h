// Objects of the map with their ledgers, and their JSON in the tools' results.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "services/gateway/mcp/arguments.h"
#include "services/gateway/mcp/map.h"

namespace perdure::gateway::mcp {

inline constexpr std::uint32_t kMostListed = 1000;  // objects of one query
inline constexpr std::size_t kMostInFull = 50;      // objects whose ledgers one answer reads

/// Returns an object with the entries that sum to the log-odds of its existence. "unexplained" is
/// the part that the ledger lacks. An object without classes has only id and existence.
Json toJson(const ObjectBelief& object, const State& state);
Json toJson(const Ended& ended, const State& state);

/// Returns the belief of an object on the map, in M.
std::optional<ObjectBelief> beliefOf(Map& map, ObjectId id);

/// Lists the objects within a square around a place, at any height.
MapReply objectsIn(Map& map, const Eigen::Vector2d& centre, double half_side);

struct Match {
  ObjectBelief belief;
  double probability = 0.0;  ///< that it meets the conditions
};
struct Matches {
  std::vector<Match> found;
  bool truncated = false;
};
using Before = std::function<bool(const MapObject&, const MapObject&)>;
/// Returns the objects on the map that meet the conditions and were first seen at `first_seen` or
/// later. If there are too many, the first ones by `before`.
Matches matchesOf(Map& map, const Conditions& conditions, const Before& before,
                  TimePoint first_seen = TimePoint::min());

/// Returns the present state of an object, also if it was merged into another or is gone. Throws
/// NoAnswer if the map never had it.
struct Present {
  ObjectBelief belief;
  Json json;
};
Present presentOf(Map& map, const State& state, ObjectId id);

}  // namespace perdure::gateway::mcp
