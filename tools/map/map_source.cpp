#include "tools/map/map_source.h"

#include <chrono>
#include <optional>

#include "common/base/errors.h"
#include "common/bus/topics.h"
#include "common/bus/wait_loop.h"

namespace perdure::tools {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

[[noreturn]] void cannotRead(const std::string& path, const Reason& reason) {
  throw StartupError(ExitCode::kUnavailable,
                     path + " cannot be read: " + reason.detail +
                         "; map_store sets a damaged file aside at its next start");
}

}  // namespace

Result<MapReply> askMapStore(const bus::Participant& participant, MapQuery query,
                             double patience_s) {
  constexpr auto kResend = 500ms;
  bus::Writer<MapQuery> questions(participant, bus::topics::kMapQuery);
  bus::Reader<MapReply> answers(participant, bus::topics::kMapReply);
  query.client = makeInstanceId();
  query.request = 1;

  std::optional<MapReply> reply;
  bus::WaitLoop loop(participant);
  loop.on(answers, [&](const MapReply& r) {
    if (r.client == query.client && r.request == query.request) reply = r;
  });
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(patience_s));
  Clock::time_point next_send{};
  bool matched = false;
  while (!reply) {
    const auto now = Clock::now();
    if (now >= end) return fail(matched ? "no_answer" : "no_map_store");
    matched = questions.matched() > 0 && answers.matched() > 0;
    if (matched && now >= next_send) {
      (void)questions.write(query);
      next_send = now + kResend;
    }
    loop.runOnce(20ms);
  }
  return *reply;
}

MapReply askMapFile(const std::string& path, const MapQuery& query) {
  const auto connection = map_store::openStoreForReading(path);
  const map_store::MapReader reader(&connection);
  const auto working = reader.working();
  const WorldId newest = working && *working ? (*working)->world : WorldId{};
  auto found = reader.find(query, newest, query.limit);
  if (!found) cannotRead(path, found.error());
  MapReply reply;
  reply.truncated = found->truncated;
  reply.objects = std::move(found->objects);
  reply.beliefs = std::move(found->beliefs);
  return reply;
}

std::vector<map_store::PlacedBelief> beliefsOfMapFile(const std::string& path) {
  const auto connection = map_store::openStoreForReading(path);
  auto beliefs = map_store::MapReader(&connection).beliefs();
  if (!beliefs) cannotRead(path, beliefs.error());
  return std::move(*beliefs);
}

}  // namespace perdure::tools
