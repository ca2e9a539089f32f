#include "services/map_store/config.h"

namespace perdure::map_store {

void describe(Config& c, config::Fields& fields) {
  fields.text("store.path", c.store_path,
              {"file of the map; its folder is created if it is missing", "",
               "give a file in a folder that the service may write"});
  fields.number(
      "store.commit_period", c.commit_period_s, config::between(0.01, 0.9),
      {"time for which changes are collected before they are written and synced to the disk", "s",
       "a confirmed object must be on the disk within one second"});
  fields.integer("store.max_size", c.max_size_mb, config::between(0, 1 << 20),
                 {"largest size of the file; 0: limited by the disk", "MiB"});
  fields.boolean("store.check_at_start", c.check_at_start,
                 {"read the whole file at the start, and set it aside if it is damaged"});
  fields.text("store.url", c.fleet.url,
              {"PostgreSQL server to which the map is also sent, as postgresql://…; empty: none",
               "", "give postgresql://USER@HOST:PORT/DATABASE?passfile=FILE"});
  fields.text("store.vehicle", c.fleet.vehicle,
              {"name of this vehicle's map on the server; empty: the host's name"});
  fields.numbers("store.earth_anchor", c.fleet.earth_anchor, {},
                 {"position of the map's frame of reference on Earth, for the server's geometry: "
                  "latitude, longitude, height, yaw of its x axis from east; []: the position "
                  "stored in the map, from the calibration",
                  "°, m", "give four numbers, or []"});
  fields.number("tiles.size", c.tile_size_m, config::between(1.0, 10000.0),
                {"width of the square tiles in which the map is published", "m"});
  fields.number("tiles.period", c.tile_period_s, config::between(0.05, 60.0),
                {"shortest interval between publications of changed tiles", "s"});
  fields.integer("query.limit", c.query_limit, config::between(1, 4096),
                 {"largest number of objects in a reply, regardless of the query"});
  fields.integer("query.cached_replies", c.cached_replies, config::between(1, 10000),
                 {"number of replies that are cached for repeated requests"});
  fields.boolean("graph.enabled", c.graph,
                 {"assign objects to anchors along the trajectory; a pose graph corrects the "
                  "anchors if objects show that the body returned to an earlier place"});
  mapping::Parameters& m = c.mapping;
  fields.number(
      "graph.walk_position", m.anchor.walk_position, config::between(1e-4, 1.0),
      {"random walk of the position for poses without increments; loops scale it", "m/√m"});
  fields.number("graph.walk_yaw", m.anchor.walk_yaw, config::between(1e-6, 0.1),
                {"random walk of the yaw for poses without increments; loops scale it", "rad/√m"});
  fields.number(
      "graph.hold_back", m.loop.hold_back_m, config::between(0.1, 10.0),
      {"largest standard deviation of an object's position relative to the body, for a recall",
       "m"});
  fields.number("loop.nats", m.loop.nats, config::between(1.0, 100.0),
                {"smallest log-likelihood ratio of a loop to its best alternative, if the standard "
                 "deviation of the body's position is above 1.6 m",
                 "nats"});
  fields.number("corrections.nats", c.correction_nats, config::between(0.5, 50.0),
                {"log-likelihood ratio of a person's correction that states none; exceeds the "
                 "filter's largest "
                 "log-odds of existence (6.9) and a loop (8)",
                 "nats"});
}

}  // namespace perdure::map_store
