#include "services/map_store/fleet/server_schema.h"

#include <string>

#include "services/map_store/core/sqlite.h"
#include "services/map_store/fleet/tables.h"

namespace perdure::map_store::fleet {
namespace {

/// Takes a lock, so that only one process at a time creates the schema.
constexpr char kLock[] = "SELECT pg_advisory_xact_lock(1346720324)";

// A map belongs to one file and one vehicle's name. The server has the entries of the file's outbox
// up to `sent`. While next_table is below 8, the whole file is being sent, and row next_id of that
// table is next.
constexpr char kMaps[] = R"sql(
CREATE TABLE perdure.about(version bigint NOT NULL);
CREATE TABLE perdure.maps(
  number bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  vehicle text NOT NULL, file text NOT NULL, outbox text NOT NULL,
  sent bigint NOT NULL, next_table bigint NOT NULL, next_id bigint NOT NULL,
  whole boolean NOT NULL, revision bigint NOT NULL DEFAULT 0, tile_size_m text,
  working bytea, world bigint, epoch bigint,
  latitude float8, longitude float8, height float8, yaw float8,
  changed timestamptz NOT NULL DEFAULT now(), UNIQUE(vehicle, file));
)sql";

constexpr char kFunctions[] = R"sql(
CREATE FUNCTION perdure.clear(of_map bigint) RETURNS void LANGUAGE sql AS $$
  DELETE FROM perdure.graph_classes WHERE map = of_map;
  DELETE FROM perdure.anchors WHERE map = of_map;
  DELETE FROM perdure.anchor_poses WHERE map = of_map;
  DELETE FROM perdure.edges WHERE map = of_map;
  DELETE FROM perdure.objects WHERE map = of_map;
  DELETE FROM perdure.sightings WHERE map = of_map;
  DELETE FROM perdure.views WHERE map = of_map;
  DELETE FROM perdure.working WHERE map = of_map;
$$;
CREATE FUNCTION perdure.attach(a_vehicle text, a_file text, an_outbox text, acknowledged bigint,
    last_given bigint, a_latitude float8, a_longitude float8, a_height float8, a_yaw float8)
  RETURNS SETOF perdure.maps LANGUAGE plpgsql AS $$
DECLARE
  m perdure.maps;
BEGIN
  INSERT INTO perdure.maps(vehicle, file, outbox, sent, next_table, next_id, whole)
    VALUES(a_vehicle, a_file, '', 0, 0, -9223372036854775808, false) ON CONFLICT DO NOTHING;
  SELECT * INTO m FROM perdure.maps WHERE vehicle = a_vehicle AND file = a_file FOR UPDATE;
  IF m.outbox <> an_outbox OR m.sent < acknowledged OR m.sent > last_given THEN
    PERFORM perdure.clear(m.number);
    UPDATE perdure.maps SET outbox = an_outbox, sent = last_given, next_table = 0,
      next_id = -9223372036854775808, whole = false WHERE number = m.number;
  END IF;
  UPDATE perdure.maps SET latitude = a_latitude, longitude = a_longitude, height = a_height,
    yaw = a_yaw WHERE number = m.number AND
    (latitude, longitude, height, yaw) IS DISTINCT FROM (a_latitude, a_longitude, a_height, a_yaw);
  RETURN QUERY SELECT * FROM perdure.maps WHERE number = m.number;
END $$;
CREATE FUNCTION perdure.advance(a_map bigint, an_outbox text, sent_before bigint,
    table_before bigint, id_before bigint, sent_now bigint, table_now bigint, id_now bigint,
    is_whole bigint) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  m perdure.maps;
BEGIN
  UPDATE perdure.maps SET sent = sent_now, next_table = table_now, next_id = id_now,
    whole = is_whole <> 0, changed = now()
    WHERE number = a_map AND outbox = an_outbox AND sent = sent_before AND
      next_table = table_before AND next_id = id_before RETURNING * INTO m;
  IF NOT FOUND THEN
    RAISE EXCEPTION 'another process has written this map' USING ERRCODE = 'PE001';
  END IF;
END $$;
CREATE FUNCTION perdure.tell_map() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  IF NEW.whole THEN
    PERFORM pg_notify('perdure_maps', NEW.number || ' ' || NEW.revision || ' ' ||
      left(NEW.vehicle, 1000));
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER tell_map AFTER UPDATE ON perdure.maps
  FOR EACH ROW EXECUTE FUNCTION perdure.tell_map();
CREATE FUNCTION perdure.tell_tile() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  PERFORM pg_notify('perdure_tiles', NEW.map || ' ' || NEW.tile_x || ' ' || NEW.tile_y);
  IF TG_OP = 'UPDATE' AND (OLD.tile_x, OLD.tile_y) <> (NEW.tile_x, NEW.tile_y) THEN
    PERFORM pg_notify('perdure_tiles', OLD.map || ' ' || OLD.tile_x || ' ' || OLD.tile_y);
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER tell_tile AFTER INSERT OR UPDATE ON perdure.objects
  FOR EACH ROW EXECUTE FUNCTION perdure.tell_tile();
)sql";

// If the map has no graph, its newest frame of reference is used as M.
constexpr char kPlaces[] = R"sql(
CREATE INDEX objects_by_class ON perdure.objects(map, class);
CREATE VIEW perdure.objects_in_map AS
  SELECT o.map, m.vehicle, o.id, o.map || ':' || o.id AS key, o.class, o.class_probability,
    o.existence,
    coalesce(p.x + cos(p.yaw) * s.x - sin(p.yaw) * s.y, o.x) AS x,
    coalesce(p.y + sin(p.yaw) * s.x + cos(p.yaw) * s.y, o.y) AS y,
    coalesce(p.z + s.z, o.z) AS z, coalesce(p.yaw + s.yaw, o.yaw) AS yaw,
    o.length, o.width, o.height, o.first_seen_ns, o.last_seen_ns, o.hits, o.tile_x, o.tile_y
  FROM perdure.objects o JOIN perdure.maps m ON m.number = o.map
    LEFT JOIN perdure.sightings s ON s.map = o.map AND s.id = o.id
    LEFT JOIN perdure.anchor_poses p ON p.map = s.map AND p.id = s.anchor
  WHERE o.gone = 0 AND (p.id IS NOT NULL OR (o.world = m.world AND o.epoch = m.epoch AND
    NOT EXISTS (SELECT 1 FROM perdure.anchors a WHERE a.map = o.map)));
)sql";

// M's origin is at (latitude, longitude, height); its x axis is turned by yaw from east. The
// conversion uses ECEF, as in common/earth/geodesy.cpp. EPSG:4978 is ECEF, 4979 is WGS 84 with
// heights. @ stands for the schema of PostGIS.
constexpr char kOnEarth[] = R"sql(
CREATE FUNCTION perdure.on_earth(x float8, y float8, z float8, latitude float8, longitude float8,
    above float8, yaw float8) RETURNS @geometry LANGUAGE sql IMMUTABLE PARALLEL SAFE AS $$
  SELECT @ST_SetSRID(@ST_Transform(@ST_SetSRID(@ST_MakePoint(
      (n + above) * cl * co - so * e - sl * co * north + cl * co * z,
      (n + above) * cl * so + co * e - sl * so * north + cl * so * z,
      (n * (1 - 0.0066943799901413165) + above) * sl + cl * north + sl * z), 4978), 4979), 4326)
  FROM (SELECT 6378137.0::float8 / sqrt(1 - 0.0066943799901413165 * sind(latitude) ^ 2) AS n,
    sind(latitude) AS sl, cosd(latitude) AS cl, sind(longitude) AS so, cosd(longitude) AS co,
    x * cosd(yaw) - y * sind(yaw) AS e, x * sind(yaw) + y * cosd(yaw) AS north) AS axes
$$;
)sql";

// # stands for "local" or "wgs84", $ for the SRID, and POINT for an expression of x, y, z and the
// map m.
constexpr char kGeometry[] = R"sql(
CREATE VIEW perdure.objects_# AS
  SELECT o.*, POINT::@geometry(PointZ, $) AS place
  FROM perdure.objects_in_map o JOIN perdure.maps m ON m.number = o.map WHERE ONLY;
CREATE VIEW perdure.anchors_# AS
  SELECT o.map, m.vehicle, o.id, o.map || ':' || o.id AS key, a.world, a.epoch, a.time_ns, a.way_m,
    o.yaw, POINT::@geometry(PointZ, $) AS place
  FROM perdure.anchor_poses o JOIN perdure.anchors a ON a.map = o.map AND a.id = o.id
    JOIN perdure.maps m ON m.number = o.map WHERE ONLY;
CREATE VIEW perdure.ways_# AS
  SELECT map, vehicle, map || ':' || world || ':' || epoch AS key, world, epoch,
    @ST_MakeLine(place ORDER BY way_m, id)::@geometry(LineStringZ, $) AS way
  FROM perdure.anchors_# GROUP BY map, vehicle, world, epoch HAVING count(*) > 1;
CREATE VIEW perdure.loops_# AS
  SELECT e.map, a.vehicle, e.id, e.map || ':' || e.id AS key, e.weight,
    @ST_MakeLine(a.place, b.place)::@geometry(LineStringZ, $) AS loop
  FROM perdure.edges e JOIN perdure.anchors_# a ON a.map = e.map AND a.id = e.a
    JOIN perdure.anchors_# b ON b.map = e.map AND b.id = e.b WHERE e.kind = 1;
)sql";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

std::string geometryIn(const std::string& schema, bool on_earth) {
  const std::string point =
      on_earth ? "perdure.on_earth(o.x, o.y, o.z, m.latitude, m.longitude, m.height, m.yaw)"
               : "@ST_MakePoint(o.x, o.y, o.z)";
  std::string sql = replaced(kGeometry, "POINT::", point + "::");
  sql = replaced(sql, "ONLY", on_earth ? "m.latitude IS NOT NULL" : "true");
  sql = replaced(replaced(sql, "#", on_earth ? "wgs84" : "local"), "$", on_earth ? "4326" : "0");
  return replaced(sql, "@", schema + ".");
}

std::string wholeSchema() {
  std::string sql = "CREATE SCHEMA perdure;";
  sql += kMaps;
  for (std::int64_t number = 0; number + 1 < kOutboxTables; ++number) {
    sql += creationOf(tableOf(static_cast<OutboxTable>(number)));
  }
  sql += creationOf(workingTable());
  return sql + kFunctions + kPlaces + "INSERT INTO perdure.about VALUES(" +
         std::to_string(kServerSchema) + ");";
}

/// Returns whether schema perdure has `name`. Reads the catalogue, because to_regclass() may not
/// see another process's commit yet.
bool exists(Link& link, std::string_view name) {
  return need(link.ask("SELECT EXISTS(SELECT 1 FROM pg_catalog.pg_class c JOIN "
                       "pg_catalog.pg_namespace n ON n.oid = c.relnamespace "
                       "WHERE n.nspname = 'perdure' AND c.relname = $1::text)",
                       Values().put(name)))
      .boolean(0, 0);
}

/// Runs `sql` unless schema perdure has `name`. Only one process at a time does this.
void makeOnce(Link& link, std::string_view name, const std::string& sql) {
  if (exists(link, name)) return;
  const auto done = attempt([&] {
    need(link.run("BEGIN"));
    need(link.run(kLock));
    if (!exists(link, name)) need(link.run(sql));
  });
  if (done) return need(link.run("COMMIT"));
  (void)link.run("ROLLBACK");
  need(done);
}

/// Returns the schema of PostGIS; empty if PostGIS is not installed.
std::string schemaOfPostgis(Link& link) {
  const auto answer =
      need(link.ask("SELECT quote_ident(n.nspname) FROM pg_extension e JOIN pg_namespace n "
                    "ON n.oid = e.extnamespace WHERE e.extname = 'postgis'"));
  return answer.rows() == 0 ? std::string() : answer.text(0, 0);
}

void checkVersion(Link& link) {
  const auto encoding = need(link.ask("SELECT current_setting('server_encoding')")).text(0, 0);
  if (encoding != "UTF8") {
    throw Failed{{"server_schema", "the database's encoding is " + encoding + ", not UTF8"}};
  }
  const auto version = need(link.ask("SELECT max(version) FROM perdure.about")).integer(0, 0);
  if (version == kServerSchema) return;
  throw Failed{{"server_schema", "the maps there have schema " + std::to_string(version) +
                                     ", this program knows " + std::to_string(kServerSchema) +
                                     ". Vehicles send all again where schema perdure is dropped "
                                     "there"}};
}

}  // namespace

Result<bool> prepareServer(Link& link) {
  return attempt([&] {
    makeOnce(link, "about", wholeSchema());
    checkVersion(link);
    std::string postgis = schemaOfPostgis(link);
    if (postgis.empty()) {
      const auto made = link.run("CREATE EXTENSION IF NOT EXISTS postgis");
      if (!made && made.error().code == "server_unreachable") need(made);
      if (made) postgis = schemaOfPostgis(link);
      if (postgis.empty()) return false;
    }
    makeOnce(link, "loops_wgs84",
             replaced(kOnEarth, "@", postgis + ".") + geometryIn(postgis, false) +
                 geometryIn(postgis, true));
    return true;
  });
}

}  // namespace perdure::map_store::fleet
