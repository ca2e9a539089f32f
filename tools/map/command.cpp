#include "tools/map/command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <numbers>
#include <vector>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "tools/bus_tools/common.h"
#include "tools/map/fuse.h"
#include "tools/map/map_source.h"
#include "tools/map/render.h"
#include "tools/map/why.h"
#include "tools/outputs/ledger_json.h"

namespace perdure::tools {
namespace {

struct Request {
  bus::Options bus;
  std::string db;
  double patience_s = 5.0;
  bool json = false, geojson = false;
  std::string out;
  std::vector<double> radius, box, anchor;
  std::vector<std::string> maps;
  MapQuery query;
};

MapReply askOverDds(const Request& request) {
  const bus::Domain domain(request.bus);
  const bus::Participant participant(domain, "perdure map");
  const auto reply = askMapStore(participant, request.query, request.patience_s);
  if (reply) return *reply;
  const bus::Options& bus = domain.options();
  throw StartupError(
      ExitCode::kUnavailable,
      fmt::format(
          "{} on domain {}, interface {}, vehicle {} within {} s; start perdure-map-store "
          "there, or read its file with --db",
          reply.error().code == "no_answer" ? "map_store does not answer" : "there is no map_store",
          bus.domain, bus.interface, bus.vehicle, request.patience_s));
}

MapReply ask(const Request& request) {
  MapReply reply = request.db.empty() ? askOverDds(request) : askMapFile(request.db, request.query);
  if (!reply.ok) throw StartupError(ExitCode::kUsage, reply.error);
  if (reply.truncated) {
    std::cerr
        << "perdure map: there are more than these " << reply.objects.size()
        << " objects; raise --limit and map_store's query.limit, or read the file with --db\n";
  }
  return reply;
}

nlohmann::ordered_json jsonOf(const std::vector<MapObject>& objects) {
  auto list = nlohmann::ordered_json::array();
  for (const MapObject& object : objects) list.push_back(toJson(object));
  return {{"objects", list}};
}

void list(const Request& request) {
  const MapReply reply = ask(request);
  std::cout << (request.json ? jsonOf(reply.objects).dump(1) + "\n" : toTable(reply.objects));
}

/// Asks for one object by its id. Throws StartupError where there is none.
MapReply askForOne(const Request& request) {
  MapReply reply = ask(request);
  if (reply.objects.empty()) {
    throw StartupError(ExitCode::kFailure, "the map has no object " +
                                               std::to_string(request.query.object_id) +
                                               "; `perdure map list` shows those it has");
  }
  return reply;
}

void show(const Request& request) {
  const MapObject object = askForOne(request).objects.front();
  std::cout << (request.json ? toJson(object).dump(1) + "\n" : toText(object));
}

void why(const Request& request) {
  const MapReply reply = askForOne(request);
  if (reply.beliefs.empty()) {
    throw StartupError(ExitCode::kFailure,
                       "this map_store is an older one and does not say why; start one of this "
                       "version, or read its file with --db");
  }
  const ObjectBelief& belief = reply.beliefs.front();
  std::cout << (request.json ? toJson(belief.why).dump(1) + "\n" : toWhy(belief));
}

void chooseKind(Request& request) {
  const int given =
      !request.query.class_name.empty() + !request.radius.empty() + !request.box.empty();
  if (given != 1) {
    throw StartupError(ExitCode::kUsage,
                       "give one of --class NAME, --radius X Y Z R, --box X1 Y1 Z1 X2 Y2 Z2");
  }
  request.query.kind = MapQueryKind::kByClass;
  if (!request.radius.empty()) {
    request.query.kind = MapQueryKind::kByRadius;
    request.query.low = Eigen::Vector3d(request.radius.data());
    request.query.radius = request.radius[3];
  } else if (!request.box.empty()) {
    request.query.kind = MapQueryKind::kByBox;
    const Eigen::Vector3d a(request.box.data()), b(request.box.data() + 3);
    request.query.low = a.cwiseMin(b);
    request.query.high = a.cwiseMax(b);
  }
}

std::optional<GeoAnchor> anchorOf(const Request& request) {
  if (request.anchor.empty()) return std::nullopt;
  const auto& a = request.anchor;
  return GeoAnchor{{}, a[0], a[1], a[2], a[3] * std::numbers::pi / 180.0};
}

void exportMap(const Request& request) {
  const MapReply reply = ask(request);
  const auto json =
      request.geojson ? toGeoJson(reply.objects, anchorOf(request)) : jsonOf(reply.objects);
  if (request.out.empty()) {
    std::cout << json.dump(1) << "\n";
    return;
  }
  writeChecked(request.out, json.dump(1) + "\n");
}

void addSource(CLI::App& command, Request& request) {
  command.add_option("--db", request.db, "read this file instead of asking the running map_store")
      ->type_name("FILE");
  addBusOptions(command, request.bus);
  command.add_option("--wait", request.patience_s, "seconds until giving up")
      ->check(CLI::PositiveNumber);
  command.add_option("--limit", request.query.limit, "at most so many objects")
      ->check(CLI::PositiveNumber);
}

}  // namespace

void addMapCommand(CLI::App& app) {
  auto request = std::make_shared<Request>();
  CLI::App* map = app.add_subcommand("map", "What the map holds: over DDS, or from its file");
  map->require_subcommand(1);

  CLI::App* listing = map->add_subcommand("list", "All objects, one a line");
  listing->add_flag("--json", request->json, "as JSON, with covariances");
  listing->callback([request] { list(*request); });

  CLI::App* showing = map->add_subcommand("show", "Everything about one object");
  showing->add_option("ID", request->query.object_id, "the object's id")->required();
  showing->add_flag("--json", request->json, "as JSON, with covariances");
  showing->callback([request] {
    request->query.kind = MapQueryKind::kById;
    show(*request);
  });

  CLI::App* explaining = map->add_subcommand("why", "Why an object is believed, entry by entry");
  explaining->add_option("ID", request->query.object_id, "the object's id")->required();
  explaining->add_flag("--json", request->json, "the ledger as JSON");
  explaining->callback([request] {
    request->query.kind = MapQueryKind::kById;
    why(*request);
  });

  CLI::App* query = map->add_subcommand("query", "Objects of a class, or in a place");
  query->add_option("--class", request->query.class_name, "of this most probable class");
  query->add_option("--radius", request->radius, "X Y Z R: centres within R metres, nearest first")
      ->expected(4);
  query->add_option("--box", request->box, "X1 Y1 Z1 X2 Y2 Z2: centres between two corners")
      ->expected(6);
  query->add_flag("--json", request->json, "as JSON, with covariances");
  query->callback([request] {
    chooseKind(*request);
    list(*request);
  });

  CLI::App* exporting = map->add_subcommand("export", "The map as JSON or GeoJSON");
  exporting->add_flag("--geojson", request->geojson, "GeoJSON (RFC 7946)");
  exporting
      ->add_option("--anchor", request->anchor,
                   "LATITUDE LONGITUDE HEIGHT YAW: where W's origin lies, degrees and metres; "
                   "yaw of its x axis from east")
      ->expected(4);
  exporting->add_option("--out", request->out, "into this file")->type_name("FILE");
  exporting->callback([request] { exportMap(*request); });

  addFuseCommand(*map);

  for (CLI::App* command : {listing, showing, explaining, query, exporting})
    addSource(*command, *request);
}

}  // namespace perdure::tools
