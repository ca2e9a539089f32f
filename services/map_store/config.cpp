#include "services/map_store/config.h"

namespace perdure::map_store {

void describe(Config& c, config::Fields& fields) {
  fields.text("store.path", c.store_path,
              {"the map's file; its folder is made where it is missing", "",
               "give a file in a folder that the service may write"});
  fields.number("store.commit_period", c.commit_period_s, config::between(0.01, 0.9),
                {"changes are gathered this long, then written and synced to the disk", "s",
                 "a confirmed object is to be durable within one second"});
  fields.integer("store.max_size", c.max_size_mb, config::between(0, 1 << 20),
                 {"the file grows no further than this; 0: as large as the disk", "MiB", ""});
  fields.boolean("store.check_at_start", c.check_at_start,
                 {"read the whole file at the start and set it aside where it is damaged"});
  fields.text(
      "store.url", c.fleet.url,
      {"a PostgreSQL server to which the map is sent as well, as postgresql://…; empty: none", "",
       "give postgresql://USER@HOST:PORT/DATABASE?passfile=FILE"});
  fields.text("store.vehicle", c.fleet.vehicle,
              {"the name of this vehicle's map there; empty: the host's name", "", ""});
  fields.numbers(
      "store.earth_anchor", c.fleet.earth_anchor, {},
      {"where the map's frame of reference lies on Earth, for the server's geometry: "
       "latitude, longitude, height, yaw of its x axis from east; []: as the map knows it "
       "from the calibration",
       "°, m", "give four numbers, or []"});
  fields.number("tiles.size", c.tile_size_m, config::between(1.0, 10000.0),
                {"width of the squares in which the map is published", "m", ""});
  fields.number("tiles.period", c.tile_period_s, config::between(0.05, 60.0),
                {"changed squares are published at most this often", "s", ""});
  fields.integer("query.limit", c.query_limit, config::between(1, 4096),
                 {"a reply holds at most this many objects, whatever the query asks for", "", ""});
  fields.integer("query.cached_replies", c.cached_replies, config::between(1, 10000),
                 {"answers kept for requests that come again", "", ""});
  fields.boolean("graph.enabled", c.graph,
                 {"objects belong to anchors along the way, and a pose graph corrects these where "
                  "objects show that the body came past before"});
  mapping::Parameters& m = c.mapping;
  fields.number("graph.walk_position", m.anchor.walk_position, config::between(1e-4, 1.0),
                {"walk of poses that come without increments; loops scale it", "m/√m", ""});
  fields.number("graph.walk_yaw", m.anchor.walk_yaw, config::between(1e-6, 0.1),
                {"the same of yaw", "rad/√m", ""});
  fields.number(
      "graph.hold_back", m.loop.hold_back_m, config::between(0.1, 10.0),
      {"objects come back where their place relative to the body is known better", "m", ""});
  fields.number("loop.nats", m.loop.nats, config::between(1.0, 100.0),
                {"by how much a loop must be likelier than any other way to lay what is seen, "
                 "where the body is known worse than within 1.6 m",
                 "nats", ""});
}

}  // namespace perdure::map_store
