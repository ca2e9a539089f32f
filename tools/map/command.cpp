#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/types/ledger_json.h"
#include "services/map_store/core/graph/graph_answer.h"
#include "services/map_store/fleet/map_transfer.h"
#include "tools/map/correct_command.h"
#include "tools/map/fuse.h"
#include "tools/map/graph_view.h"
#include "tools/map/look_command.h"
#include "tools/map/map_place.h"
#include "tools/map/map_source.h"
#include "tools/map/render.h"
#include "tools/map/why.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

struct Request {
  MapPlace place;
  bool json = false, geojson = false;
  std::string out, frame = "M";
  std::vector<double> radius, box, anchor;
  std::vector<std::string> maps;
  MapQuery query;
};

MapReply askFile(const Request& request) {
  return MapFile(request.place.db)
      .ask(request.query, request.frame == "W" ? MapFrameChoice::kW : MapFrameChoice::kM);
}

MapReply ask(const Request& request) {
  if (request.place.db.empty() && request.frame == "W") {
    throw StartupError(ExitCode::kUsage,
                       "--frame W reads what is stored: give the map's file with --db; a running "
                       "map_store answers in M");
  }
  MapReply reply =
      request.place.db.empty() ? askOverDds(request.place, request.query) : askFile(request);
  if (!reply.ok) throw StartupError(ExitCode::kUsage, reply.error);
  if (reply.truncated) {
    std::cerr << "perdure map: there are more than these " << reply.objects.size()
              << " objects; raise --limit"
              << (request.place.db.empty()
                      ? " and map_store's query.limit, or read the file with --db"
                      : "")
              << "\n";
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

/// Requests one object by its id. Throws StartupError if the map does not have it.
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
  std::optional<Standing> standing;  // not available from a running map_store
  if (!request.place.db.empty()) standing = MapFile(request.place.db).standing(belief.id);
  if (request.json) {
    auto json = toJson(belief.why);
    if (standing) json["map"] = toJson(*standing);
    std::cout << json.dump(1) << "\n";
    return;
  }
  std::cout << toWhy(belief) << (standing ? "\n" + toText(*standing) : "");
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
  if (request.anchor.empty()) {
    const bool known = !request.place.db.empty() && request.frame == "M";
    return known ? MapFile(request.place.db).earthAnchor() : std::nullopt;
  }
  const auto& a = request.anchor;
  return GeoAnchor{{}, a[0], a[1], a[2], a[3] * std::numbers::pi / 180.0};
}

void showGraph(const Request& request) {
  MapReply graph;
  if (request.place.db.empty()) {
    graph = askOverDds(request.place, request.query);
    if (!graph.ok) throw StartupError(ExitCode::kUsage, graph.error);
  } else {
    graph = MapFile(request.place.db).graph(request.query);
  }
  std::cout << (request.json ? toGraphJson(graph).dump(1) + "\n" : toGraphText(graph));
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

void listServerMaps(const std::string& url) {
  const auto maps = map_store::fleet::listMaps(url);
  fmt::print("{:<24} {:>8} {:>8} {:>9}  {:<20}  {}\n", "name", "objects", "anchors", "revision",
             "changed", "");
  for (const auto& map : maps) {
    fmt::print("{:<24} {:>8} {:>8} {:>9}  {:<20}  {}\n", map.vehicle, map.objects, map.anchors,
               map.revision, map.changed, map.whole ? "" : "(being sent)");
  }
}

struct ServerRequest {
  std::string url, name, file;
  std::vector<double> earth_anchor;
  bool all = false, unfinished = false;
};

void pullMaps(const ServerRequest& request) {
  if (request.all != request.name.empty()) {
    throw StartupError(ExitCode::kUsage, "Give the NAME of one map, or --all.");
  }
  if (!request.all) {
    map_store::fleet::pullMap(request.url, request.name, request.file, request.unfinished);
    return;
  }
  const auto files = map_store::fleet::pullVehicles(request.url, request.file, request.unfinished);
  for (const std::string& file : files) fmt::print("{}\n", file);
}

void addServerCommands(CLI::App& map) {
  auto request = std::make_shared<ServerRequest>();
  CLI::App* maps = map.add_subcommand("maps", "The maps that a fleet's server has");
  maps->callback([request] { listServerMaps(request->url); });

  CLI::App* pull = map.add_subcommand("pull", "A map of a fleet's server as a file");
  pull->add_option("NAME", request->name, "the vehicle's name, or that of a pushed map");
  pull->add_flag("--all", request->all, "the newest map of each vehicle, as NAME.sqlite");
  pull->add_option("--out", request->file, "the new file; with --all its folder")
      ->type_name("FILE")
      ->required();
  pull->add_flag("--unfinished", request->unfinished, "also while it is being sent");
  pull->callback([request] { pullMaps(*request); });

  CLI::App* push = map.add_subcommand("push", "A file as a map of a fleet's server");
  push->add_option("FILE", request->file, "the map's file, which is only read")->required();
  push->add_option("--name", request->name, "the map's name there")->required();
  push->add_option("--earth-anchor", request->earth_anchor,
                   "latitude, longitude [°], height [m] of M's origin, yaw of its x axis from east "
                   "[°]; else its geometry is in metres alone")
      ->expected(4);
  push->callback([request] {
    map_store::fleet::pushMap(request->file, request->url, request->name, request->earth_anchor);
  });
  for (CLI::App* command : {maps, pull, push}) {
    command
        ->add_option("--url", request->url,
                     "postgresql://USER@HOST:PORT/DATABASE?passfile=FILE, without a password")
        ->required();
  }
}

void addSource(CLI::App& command, Request& request) {
  addPlace(command, request.place);
  command
      .add_option(
          "--frame", request.frame,
          "M: as the graph lays what --db holds; W: as stored, each object in the odometry's "
          "frame of its own session")
      ->check(CLI::IsMember({"M", "W"}));
  command.add_option("--limit", request.query.limit, "at most so many objects")
      ->check(CLI::PositiveNumber);
}

}  // namespace

void setUpMap(CLI::App& map) {
  auto request = std::make_shared<Request>();
  map.require_subcommand(1);

  CLI::App* listing = map.add_subcommand("list", "All objects, one a line");
  listing->add_flag("--json", request->json, "as JSON, with covariances");
  listing->callback([request] { list(*request); });

  CLI::App* showing = map.add_subcommand("show", "Everything about one object");
  showing->add_option("ID", request->query.object_id, "the object's id")->required();
  showing->add_flag("--json", request->json, "as JSON, with covariances");
  showing->callback([request] {
    request->query.kind = MapQueryKind::kById;
    show(*request);
  });

  CLI::App* explaining = map.add_subcommand("why", "Why an object is believed, entry by entry");
  explaining->add_option("ID", request->query.object_id, "the object's id")->required();
  explaining->add_flag("--json", request->json, "the ledger as JSON");
  explaining->callback([request] {
    request->query.kind = MapQueryKind::kById;
    why(*request);
  });

  CLI::App* query = map.add_subcommand("query", "Objects of a class, or in a place");
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

  CLI::App* graph = map.add_subcommand(
      "graph", "How well the map's places are known, and on what its loops rest");
  graph->add_flag("--json", request->json, "anchors and loops as JSON");
  graph->callback([request] {
    request->query.kind = MapQueryKind::kGraph;
    request->query.limit = map_store::kMostAnchors;
    showGraph(*request);
  });
  addPlace(*graph, request->place);

  CLI::App* exporting = map.add_subcommand("export", "The map as JSON or GeoJSON");
  exporting->add_flag("--geojson", request->geojson, "GeoJSON (RFC 7946)");
  exporting
      ->add_option("--anchor", request->anchor,
                   "LATITUDE LONGITUDE HEIGHT YAW: where M's origin lies, degrees and metres; "
                   "yaw of its x axis from east; without: as the map's file knows it")
      ->expected(4);
  exporting->add_option("--out", request->out, "into this file")->type_name("FILE");
  exporting->callback([request] { exportMap(*request); });

  addCorrectCommand(map);
  addServerCommands(map);
  addFuseCommand(map);
  addLookCommand(map);

  for (CLI::App* command : {listing, showing, explaining, query, exporting})
    addSource(*command, *request);
}

}  // namespace perdure::tools
