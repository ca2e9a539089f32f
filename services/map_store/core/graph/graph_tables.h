// The pose graph in the map's file: its tables, written within a transaction and read whole.
#pragma once

#include <cstdint>
#include <set>

#include "common/base/result.h"
#include "services/map_store/core/graph/graph_codec.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// Maps of older versions have no tables of the graph.
inline constexpr int kFirstSchemaWithGraph = 3;

/// SQL that makes the tables.
extern const char* const kGraphSchema;
/// The same of tables that came later: views, and tracks that share an object with others. Does
/// nothing if they exist.
extern const char* const kAddedSchema;

/// What a file holds, such that the ends of edges, the anchors of sightings and predecessors of
/// the same session exist, and one anchor of each component is held fast.
struct SavedGraph {
  mapping::SavedMap map;
  /// What could not be read, or hung on what could not. Left out; of some records `earlier` only.
  std::uint64_t malformed = 0;
  std::set<ObjectId> shortened;  ///< records that lost `earlier`
};

/// One state of the file, also while another process writes it. Of an older map: an empty one.
Result<SavedGraph> readGraph(const Connection& connection);

/// Within the caller's transaction. What is not sound (graph_codec.h) is left as it is stored;
/// returns how many these are. Records of objects that were not confirmed are not written.
Result<std::uint64_t> writeGraph(const Connection& connection, const mapping::Unsaved& unsaved);

/// Which tracks are one object; empty for a map of an older version.
Result<std::set<mapping::SameObject>> readFacts(const Connection& connection);
/// Within the caller's transaction.
Result<void> writeFacts(const Connection& connection, const mapping::Unsaved& unsaved);

/// Within the caller's transaction: deletes what readGraph leaves out. A mapper that begins with
/// what was read gives those ids again.
Result<void> sweepGraph(const Connection& connection);

}  // namespace perdure::map_store
