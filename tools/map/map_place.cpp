#include "tools/map/map_place.h"

#include "common/base/errors.h"
#include "common/bus/map_client.h"
#include "tools/bus_tools/common.h"

namespace perdure::tools {
namespace {

MapReply replyOf(const MapPlace& place, auto send) {
  const bus::Domain domain(place.bus);
  const bus::Participant participant(domain, "perdure map");
  bus::MapClient client(participant);
  auto reply = send(client);
  if (reply) return *std::move(reply);
  const bus::Options& bus = domain.options();
  throw StartupError(
      ExitCode::kUnavailable,
      "{} on domain {}, interface {}, vehicle {} within {} s; start "
      "perdure-map-store there, or give its file with --db",
      reply.error().code == "no_answer" ? "map_store does not answer" : "there is no map_store",
      bus.domain, bus.interface, bus.vehicle, place.patience_s);
}

}  // namespace

void addPlace(CLI::App& command, MapPlace& place) {
  command.add_option("--db", place.db, "use this file instead of asking the running map_store")
      ->type_name("FILE");
  addBusOptions(command, place.bus);
  command.add_option("--wait", place.patience_s, "seconds until giving up")
      ->check(CLI::PositiveNumber);
}

MapReply askOverDds(const MapPlace& place, const MapQuery& query) {
  return replyOf(place, [&](bus::MapClient& map) { return map.ask(query, place.patience_s); });
}

MapReply correctOverDds(const MapPlace& place, const Correction& correction) {
  return replyOf(place,
                 [&](bus::MapClient& map) { return map.correct(correction, place.patience_s); });
}

}  // namespace perdure::tools
