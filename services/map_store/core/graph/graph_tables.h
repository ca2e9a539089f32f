// The tables of the pose graph. They are read as a whole.
#pragma once

#include <cstdint>
#include <set>

#include "common/base/result.h"
#include "services/map_store/core/graph/graph_codec.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// Maps of older versions have no tables of the graph.
inline constexpr int kFirstSchemaWithGraph = 3;

extern const char* const kGraphSchema;
/// SQL that creates the later tables if they do not exist: views, and tracks that share an object.
extern const char* const kAddedSchema;

/// The graph in a file. The ends of edges, the anchors of sightings and predecessors of the same
/// session exist. One anchor of each component is fixed.
struct SavedGraph {
  mapping::SavedMap map;
  /// Number of parts left out because they, or parts that they depend on, could not be read.
  std::uint64_t malformed = 0;
  std::set<ObjectId> shortened;  ///< records that lost `earlier`
};

/// Reads one state of the file, even during writes. Returns an empty graph for older maps.
Result<SavedGraph> readGraph(const Connection& connection);

// The functions that write do so within the caller's transaction and throw Failed.

/// Unsound parts (graph_codec.h) stay as they are stored; returns their number. Records of objects
/// that were not confirmed are not written.
std::uint64_t writeGraph(const Connection& connection, const mapping::Unsaved& unsaved);

/// Returns which tracks are one object; empty for maps of older versions.
Result<std::set<mapping::SameObject>> readFacts(const Connection& connection);
void writeFacts(const Connection& connection, const mapping::Unsaved& unsaved);

/// Deletes the rows that readGraph leaves out, because their ids are reused.
void sweepGraph(const Connection& connection);

}  // namespace perdure::map_store
