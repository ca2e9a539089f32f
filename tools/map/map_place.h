// The place of a map, for commands: a file, or the running map_store on the bus.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "common/bus/endpoint.h"
#include "common/types/map.h"

namespace perdure::tools {

struct MapPlace {
  bus::Options bus;
  std::string db;  ///< the file; empty: the running map_store
  double patience_s = 5.0;
};

/// Adds --db, the options of the bus, and --wait.
void addPlace(CLI::App& command, MapPlace& place);

// Ask the running map_store. They throw StartupError, with the fix, if there is no reply.
MapReply askOverDds(const MapPlace& place, const MapQuery& query);
MapReply correctOverDds(const MapPlace& place, const Correction& correction);

}  // namespace perdure::tools
