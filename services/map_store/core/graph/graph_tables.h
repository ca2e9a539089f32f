// The tables of the pose graph. The graph is always read as a whole.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "common/base/result.h"
#include "services/map_store/core/graph/graph_codec.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// The first schema with tables of the graph.
inline constexpr int kFirstSchemaWithGraph = 3;

extern const char* const kGraphSchema;
/// SQL that creates tables of later versions if they do not exist: views, tracks that share an
/// object, and corrections by people.
extern const char* const kAddedSchema;

/// The graph in a file. It is consistent: it has the ends of all edges, the anchors of all
/// sightings, and the predecessors of all anchors. Each component has a fixed anchor.
struct SavedGraph {
  mapping::SavedMap map;
  /// Number of parts left out because they, or parts that they depend on, could not be read.
  std::uint64_t malformed = 0;
  std::set<ObjectId> shortened;  ///< records whose `earlier` was left out
};

/// Reads one state of the file, even while it is written. Returns an empty graph for maps with an
/// older schema.
Result<SavedGraph> readGraph(const Connection& connection);

// The write functions run within the caller's transaction and throw Failed.

/// Writes the changes. Does not write unsound parts (graph_codec.h), whose stored rows remain, and
/// returns their number. Does not write records of unconfirmed objects.
std::uint64_t writeGraph(const Connection& connection, const mapping::Unsaved& unsaved);

/// Reads the pairs of tracks of the same object. Empty for maps with an older schema.
Result<std::set<mapping::SameObject>> readFacts(const Connection& connection);
/// Reads the corrections, sorted by id. Empty for files without them.
Result<std::vector<Correction>> readCorrections(const Connection& connection);
/// Writes the changes of facts and corrections.
void writeFacts(const Connection& connection, const mapping::Unsaved& unsaved);

/// Deletes the rows that readGraph() leaves out, because their ids will be reused.
void sweepGraph(const Connection& connection);

}  // namespace perdure::map_store
