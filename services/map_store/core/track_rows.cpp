#include "services/map_store/core/track_rows.h"

#include <utility>

namespace perdure::map_store {
namespace {

std::optional<StoredTrack> trackFrom(TrackId id, const Statement& row) {
  auto belief = decodeBelief(row.blob(5));
  if (!belief) return std::nullopt;
  StoredTrack track{id,
                    {{row.id(0), static_cast<std::uint32_t>(row.integer(1))}, *std::move(belief)},
                    row.id(2),
                    std::nullopt};
  if (row.integer(3) != 0) track.gone = fromNanoseconds(row.integer(4));
  return track;
}

}  // namespace

std::optional<StoredTrack> readTrack(const Connection& connection, TrackId id) {
  return need(connection.first(
                  "SELECT world, epoch, written, gone, gone_ns, belief FROM tracks WHERE id = ?1",
                  [&](const Statement& row) { return trackFrom(id, row); }, id))
      .value_or(std::nullopt);
}

void writeTrack(const Connection& connection, const StoredTrack& track) {
  const WorldId& world = track.placed.world;
  need(connection.run("REPLACE INTO tracks VALUES(?1, ?2, ?3, ?4, 0, NULL, ?5)", track.id,
                      world.world, world.epoch, track.written, encodeBelief(track.placed.belief)));
}

void shareTrack(const Connection& connection, TrackId id) {
  need(connection.run(
      "INSERT OR IGNORE INTO tracks SELECT id, world, epoch, 0, gone, gone_ns, belief "
      "FROM objects WHERE id = ?1 AND merged_into IS NULL",
      id));
}

void endTrack(const Connection& connection, TrackId id, TimePoint time) {
  need(connection.run("UPDATE tracks SET gone = 1, gone_ns = ?2 WHERE id = ?1", id, time));
}

void deleteTrack(const Connection& connection, TrackId id) {
  need(connection.run("DELETE FROM tracks WHERE id = ?1", id));
}

}  // namespace perdure::map_store
