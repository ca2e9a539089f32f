#include "services/map_store/core/track_rows.h"

#include <string_view>
#include <utility>

namespace perdure::map_store {
namespace {

/// Prepares the statement, binds the id to ?1, and calls `bind` for the other parameters.
template <class Bind>
Result<void> runFor(const Connection& connection, std::string_view sql, TrackId id, Bind bind) {
  auto statement = connection.prepare(sql);
  if (!statement) return tl::unexpected<Reason>(statement.error());
  statement->bindId(1, id);
  bind(*statement);
  return statement->run();
}

constexpr auto kNoMore = [](Statement&) {};

}  // namespace

Result<std::optional<StoredTrack>> readTrack(const Connection& connection, TrackId id) {
  auto row = connection.prepare(
      "SELECT world, epoch, written, gone, gone_ns, belief FROM tracks WHERE id = ?1");
  if (!row) return tl::unexpected<Reason>(row.error());
  const auto there = row->bindId(1, id).step();
  if (!there) return tl::unexpected<Reason>(there.error());
  if (!*there) return std::optional<StoredTrack>();
  auto belief = decodeBelief(row->blob(5));
  if (!belief) return std::optional<StoredTrack>();
  StoredTrack track{id,
                    {{row->id(0), static_cast<std::uint32_t>(row->integer(1))}, *std::move(belief)},
                    row->id(2),
                    std::nullopt};
  if (row->integer(3) != 0) track.gone = fromNanoseconds(row->integer(4));
  return std::optional(std::move(track));
}

Result<void> writeTrack(const Connection& connection, const StoredTrack& track) {
  const Bytes bytes = encodeBelief(track.placed.belief);
  return runFor(connection, "REPLACE INTO tracks VALUES(?1, ?2, ?3, ?4, 0, NULL, ?5)", track.id,
                [&](Statement& to) {
                  to.bindId(2, track.placed.world.world);
                  to.bind(3, std::int64_t{track.placed.world.epoch}).bindId(4, track.written);
                  to.bind(5, std::span<const std::uint8_t>(bytes));
                });
}

Result<void> shareTrack(const Connection& connection, TrackId id) {
  return runFor(connection,
                "INSERT OR IGNORE INTO tracks SELECT id, world, epoch, 0, gone, gone_ns, belief "
                "FROM objects WHERE id = ?1 AND merged_into IS NULL",
                id, kNoMore);
}

Result<void> endTrack(const Connection& connection, TrackId id, TimePoint time) {
  return runFor(connection, "UPDATE tracks SET gone = 1, gone_ns = ?2 WHERE id = ?1", id,
                [&](Statement& to) { to.bind(2, toNanoseconds(time)); });
}

Result<void> deleteTrack(const Connection& connection, TrackId id) {
  return runFor(connection, "DELETE FROM tracks WHERE id = ?1", id, kNoMore);
}

}  // namespace perdure::map_store
