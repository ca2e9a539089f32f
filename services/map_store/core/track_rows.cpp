#include "services/map_store/core/track_rows.h"

#include <string_view>
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

Result<std::optional<StoredTrack>> readTrack(const Connection& connection, TrackId id) {
  return connection
      .first(
          "SELECT world, epoch, written, gone, gone_ns, belief FROM tracks WHERE id = ?1",
          [&](const Statement& row) { return trackFrom(id, row); }, id)
      .map([](auto track) { return std::move(track).value_or(std::nullopt); });
}

Result<void> writeTrack(const Connection& connection, const StoredTrack& track) {
  const WorldId& world = track.placed.world;
  return connection.run("REPLACE INTO tracks VALUES(?1, ?2, ?3, ?4, 0, NULL, ?5)", track.id,
                        world.world, world.epoch, track.written, encodeBelief(track.placed.belief));
}

Result<void> shareTrack(const Connection& connection, TrackId id) {
  return connection.run(
      "INSERT OR IGNORE INTO tracks SELECT id, world, epoch, 0, gone, gone_ns, belief "
      "FROM objects WHERE id = ?1 AND merged_into IS NULL",
      id);
}

Result<void> endTrack(const Connection& connection, TrackId id, TimePoint time) {
  return connection.run("UPDATE tracks SET gone = 1, gone_ns = ?2 WHERE id = ?1", id, time);
}

Result<void> deleteTrack(const Connection& connection, TrackId id) {
  return connection.run("DELETE FROM tracks WHERE id = ?1", id);
}

}  // namespace perdure::map_store
