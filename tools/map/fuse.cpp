#include "tools/map/fuse.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/errors.h"
#include "services/map_store/config.h"
#include "services/map_store/core/map_contents.h"
#include "services/map_store/core/schema.h"
#include "services/map_store/fleet/map_transfer.h"
#include "tools/base/files.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using map_store::WholeMap;

struct GivenMap {
  std::string path;
  WholeMap map;
};

[[noreturn]] void refuse(ExitCode code, const std::string& why) { throw StartupError(code, why); }

WholeMap readMap(const std::string& path) {
  auto map = map_store::readWholeMap(map_store::openStoreForReading(path));
  if (!map) map_store::cannotReadMap(path, map.error());
  return *std::move(map);
}

void refuseToReplaceInputs(const FuseRequest& request) {
  for (const std::string& file : request.files) {
    std::error_code ignored;
    if (!fs::equivalent(file, request.out, ignored)) continue;
    refuse(ExitCode::kUsage, request.out + " is one of the maps to be fused; give another --out.");
  }
}

std::vector<GivenMap> readAll(const FuseRequest& request, FuseOutcome& outcome) {
  std::vector<GivenMap> maps;
  for (const std::string& path : request.files) {
    WholeMap map = readMap(path);
    outcome.malformed += map.malformed;
    if (map.contents.graph.anchors.empty()) {
      outcome.left_out.push_back(path);
    } else {
      maps.push_back({path, std::move(map)});
    }
  }
  std::ranges::stable_sort(maps, [](const GivenMap& a, const GivenMap& b) {
    return mapping::comesFirst(a.map.contents, b.map.contents);
  });
  return maps;
}

FusedFile begunBy(const GivenMap& given) {
  FusedFile file{given.path, 0, given.map.contents.present(), {}};
  for (const auto& session : mapping::sessionsOf(given.map.contents.graph)) {
    file.report.added.push_back(session.world);
  }
  file.sessions = file.report.added.size();
  file.report.objects = file.objects;
  return file;
}

FusedFile bring(WholeMap& fused, const GivenMap& given, const mapping::Parameters& parameters) {
  FusedFile file = begunBy(given);
  file.report = mapping::fuseInto(fused.contents, given.map.contents, parameters);
  fused.revision = std::max(fused.revision, given.map.revision);
  return file;
}

/// Counts sessions and objects of each part. Objects without a position in M belong to no part.
void countParts(const mapping::MapContents& map, FuseOutcome& outcome) {
  outcome.parts = mapping::partsOf(map);
  outcome.objects_of_part.assign(outcome.parts.size(), 0);
  std::map<WorldId, std::size_t> part_of;
  for (std::size_t k = 0; k < outcome.parts.size(); ++k) {
    for (const WorldId& world : outcome.parts[k]) part_of[world] = k;
  }
  for (const auto& [id, record] : map.graph.records) {
    const WorldId& world = map.graph.anchors.at(record.sighting.anchor).anchor.session;
    const auto object = map.objects.find(id);
    if (object == map.objects.end() || object->second.ended) continue;
    ++outcome.objects_of_part[part_of.at(world)];
  }
  outcome.objects = map.present();
}

std::string nameOf(const WorldId& world) { return fmt::format("{}/{}", world.world, world.epoch); }

std::string namesOf(const std::vector<WorldId>& worlds) {
  std::string names;
  for (const WorldId& world : worlds) names += (names.empty() ? "" : ", ") + nameOf(world);
  return names;
}

const char* nameOf(mapping::Change::Kind kind) {
  return kind == mapping::Change::Kind::kMoved ? "moved" : "gone";
}

std::string lineOf(const FusedFile& file) {
  const mapping::FusionReport& report = file.report;
  std::string line = fmt::format("{}: {} sessions ({} new, {} longer, {} known), {} objects",
                                 file.path, file.sessions, report.added.size(), report.grown.size(),
                                 report.known, file.objects);
  if (report.renewed > 0) line += fmt::format(", {} seen again since", report.renewed);
  if (!report.parted.empty()) {
    line += fmt::format(
        "; session {} went on in another way in an older map, the rest of it here "
        "is left out",
        namesOf(report.parted));
  }
  if (report.corrections_left_out > 0) {
    line += fmt::format("; {} corrections are left out, because a map has at most {}",
                        report.corrections_left_out, kMostCorrections);
  }
  return line + "\n";
}

std::string partLines(const FuseOutcome& outcome) {
  std::string text;
  for (std::size_t k = 1; k < outcome.parts.size(); ++k) {
    text += fmt::format("session {} joins nothing yet: its {} objects are a part of their own\n",
                        namesOf(outcome.parts[k]), outcome.objects_of_part[k]);
  }
  return text;
}

std::string changeTable(const std::vector<mapping::Change>& changes) {
  if (changes.empty()) return {};
  std::string text =
      fmt::format("{:>6}  {:<14} {:>9} {:>9} {:>8}  {:>14}  {:<5} {:>14}  {}\n", "id", "class", "x",
                  "y", "z", "last seen s", "", "since s", "by session");
  for (const auto& change : changes) {
    text +=
        fmt::format("{:>6}  {:<14} {:>9.2f} {:>9.2f} {:>8.2f}  {:>14.3f}  {:<5} {:>14.3f}  {}\n",
                    change.id, change.class_name, change.p_M.x(), change.p_M.y(), change.p_M.z(),
                    toSeconds(change.last_seen), nameOf(change.kind), toSeconds(change.since),
                    nameOf(change.by));
  }
  return text;
}

Json toJson(const std::vector<WorldId>& worlds) {
  Json list = Json::array();
  for (const WorldId& world : worlds) {
    list.push_back(Json{{"world", world.world}, {"epoch", world.epoch}});
  }
  return list;
}

Json toJson(const FusedFile& file) {
  const mapping::FusionReport& r = file.report;
  return {{"file", file.path},         {"sessions", file.sessions},
          {"objects", file.objects},   {"new_sessions", toJson(r.added)},
          {"longer", toJson(r.grown)}, {"parted", toJson(r.parted)},
          {"known", r.known},          {"new_objects", r.objects},
          {"seen_again", r.renewed},   {"loops", r.loops},
          {"merges", r.merges},        {"corrections_left_out", r.corrections_left_out}};
}

Json toJson(const mapping::Change& change) {
  return {{"id", change.id},
          {"class", change.class_name},
          {"kind", nameOf(change.kind)},
          {"map", toJson(std::vector{change.map}).front()},
          {"position", {change.p_M.x(), change.p_M.y(), change.p_M.z()}},
          {"last_seen_ns", toNanoseconds(change.last_seen)},
          {"since_ns", toNanoseconds(change.since)},
          {"by", toJson(std::vector{change.by}).front()}};
}

/// Throws, for a failure status, if maps were left out. The written file is complete otherwise.
void complainOfLeftOut(const FuseOutcome& outcome) {
  if (outcome.left_out.empty()) return;
  std::string names;
  for (const std::string& path : outcome.left_out) names += (names.empty() ? "" : ", ") + path;
  refuse(ExitCode::kFailure,
         names +
             ": without a graph (of an older Perdure, or with graph.enabled off) the objects "
             "cannot be aligned and stay out; drive there again with this version.");
}

struct FuseCommand {
  FuseRequest request;
  std::string url, name;
  bool json = false;
};

FuseOutcome run(const FuseCommand& command) {
  if (command.url.empty()) {
    if (command.request.files.empty() || command.request.out.empty()) {
      refuse(ExitCode::kUsage,
             "Give the maps and --out FILE, or --url of a fleet's server and --name.");
    }
    return fuseFiles(command.request);
  }
  if (command.name.empty()) {
    refuse(ExitCode::kUsage, "Give --name: what the fused map is called on the server.");
  }
  return fuseFleet(command.request, command.url, command.name);
}

void fuse(const FuseCommand& command) {
  const bool json = command.json;
  const FuseOutcome outcome = run(command);
  std::cout << (json ? toJsonText(outcome) : toText(outcome));
  std::cout.flush();
  complainOfLeftOut(outcome);
}

}  // namespace

std::size_t FuseOutcome::sumOf(std::size_t mapping::FusionReport::*count) const {
  std::size_t sum = 0;
  for (const FusedFile& file : files) sum += file.report.*count;
  return sum;
}

std::vector<mapping::Change> FuseOutcome::changes() const {
  std::vector<mapping::Change> all;
  for (const FusedFile& file : files) {
    all.insert(all.end(), file.report.changes.begin(), file.report.changes.end());
  }
  return all;
}

FuseOutcome fuseFiles(const FuseRequest& request) {
  refuseToReplaceInputs(request);
  map_store::checkNewFile(request.out, request.force);
  FuseOutcome outcome;
  outcome.out = request.out;
  const std::vector<GivenMap> maps = readAll(request, outcome);
  if (maps.empty()) {
    complainOfLeftOut(outcome);
    refuse(ExitCode::kUsage, "There is nothing to fuse; give maps that map_store writes.");
  }
  const mapping::Parameters parameters = map_store::Config().mapping;
  WholeMap fused = maps.front().map;
  outcome.files.push_back(begunBy(maps.front()));
  for (std::size_t k = 1; k < maps.size(); ++k) {
    outcome.files.push_back(bring(fused, maps[k], parameters));
  }
  countParts(fused.contents, outcome);
  map_store::writeWholeMap(fused, request.out, request.force);
  return outcome;
}

FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name) {
  const fs::path place = fs::temp_directory_path();
  const TemporaryFolder folder(place / "perdure-fleet-", [&](const std::string&) {
    throw StartupError(ExitCode::kUnavailable, "No folder for the vehicles' maps can be made in " +
                                                   place.string() +
                                                   "; set TMPDIR to one that this user may write.");
  });
  for (std::string& file : map_store::fleet::pullVehicles(url, folder.path().string())) {
    request.files.push_back(std::move(file));
  }
  if (request.out.empty()) request.out = (folder.path() / "fused").string();
  FuseOutcome outcome = fuseFiles(request);
  map_store::fleet::pushMap(outcome.out, url, name);
  outcome.out =
      name + " on the server" +
      (request.out.starts_with(folder.path().string()) ? std::string() : ", " + request.out);
  return outcome;
}

std::string toText(const FuseOutcome& outcome) {
  std::string text;
  for (const FusedFile& file : outcome.files) text += lineOf(file);
  const auto changes = outcome.changes();
  text += fmt::format(
      "{} loops closed, {} objects merged, {} changes; {} objects before, {} after\n",
      outcome.loops(), outcome.merges(), changes.size(), outcome.objectsBefore(), outcome.objects);
  text += partLines(outcome) + changeTable(changes);
  if (outcome.malformed > 0) {
    text += fmt::format("{} rows could not be read and are left out\n", outcome.malformed);
  }
  return text + "written: " + outcome.out + "\n";
}

std::string toJsonText(const FuseOutcome& outcome) {
  Json files = Json::array(), parts = Json::array(), changes = Json::array();
  for (const FusedFile& file : outcome.files) files.push_back(toJson(file));
  for (std::size_t k = 0; k < outcome.parts.size(); ++k) {
    parts.push_back(
        Json{{"sessions", toJson(outcome.parts[k])}, {"objects", outcome.objects_of_part[k]}});
  }
  for (const auto& change : outcome.changes()) changes.push_back(toJson(change));
  const Json json{{"out", outcome.out},
                  {"files", files},
                  {"left_out", outcome.left_out},
                  {"malformed", outcome.malformed},
                  {"parts", parts},
                  {"loops", outcome.loops()},
                  {"merges", outcome.merges()},
                  {"objects_before", outcome.objectsBefore()},
                  {"objects", outcome.objects},
                  {"changes", changes}};
  return json.dump(1) + "\n";
}

void addFuseCommand(CLI::App& map) {
  auto given = std::make_shared<FuseCommand>();
  CLI::App* command = map.add_subcommand("fuse", "Maps of several drives or vehicles as one");
  command->add_option("FILES", given->request.files, "maps that map_store or pipeline wrote")
      ->expected(0, 10000);
  command->add_option("--out", given->request.out, "the fused map")->type_name("FILE");
  command->add_flag("--force", given->request.force, "replace --out where it is there already");
  command->add_flag("--json", given->json, "the summary as JSON");
  command->add_option("--url", given->url,
                      "also the newest map of each vehicle of this fleet's server: "
                      "postgresql://USER@HOST:PORT/DATABASE?passfile=FILE");
  command->add_option("--name", given->name, "what the fused map is called on the server");
  command->callback([given] { fuse(*given); });
}

}  // namespace perdure::tools
