// The configuration of map_store.
#pragma once

#include <cstdint>
#include <string>

#include "common/config/fields.h"
#include "common/mapping/parameters.h"
#include "services/map_store/fleet/server_url.h"

namespace perdure::map_store {

struct Config {
  std::string store_path = "state/map.sqlite";
  double commit_period_s = 0.5;
  std::int64_t max_size_mb = 0;
  bool check_at_start = true;
  fleet::Parameters fleet;  ///< server that receives a copy of the map
  double tile_size_m = 32.0;
  double tile_period_s = 1.0;
  std::int64_t query_limit = 1000;
  std::int64_t cached_replies = 64;
  bool graph = true;  ///< anchors, pose graph and loops
  mapping::Parameters mapping;
  double correction_nats = 10.0;  ///< of a correction by a person that does not state its own
};

void describe(Config& config, config::Fields& fields);

}  // namespace perdure::map_store
