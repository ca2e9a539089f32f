#include "tools/map/correct_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/base/ids.h"
#include "common/wire/checks.h"
#include "tools/map/correct_file.h"
#include "tools/map/map_place.h"
#include "tools/map/map_source.h"

namespace perdure::tools {
namespace {

struct CorrectCommand {
  MapPlace place;
  Correction correction;
  bool not_there = false, list = false, json = false;
  ObjectId same_as = 0, different_from = 0;
};

MapReply ask(const CorrectCommand& command) {
  const std::string& path = command.place.db;
  if (command.list) {
    MapQuery query;
    query.limit = 1;
    return path.empty() ? askOverDds(command.place, query) : MapFile(path).ask(query);
  }
  const Correction& correction = command.correction;
  return path.empty() ? correctOverDds(command.place, correction) : correctFile(path, correction);
}

nlohmann::ordered_json jsonOf(const Correction& each) {
  return {{"id", each.id},
          {"kind", nameOf(each.kind)},
          {"object", each.object},
          {"other", each.other},
          {"class_name", each.class_name},
          {"nats", each.nats},
          {"author", each.author},
          {"time_ns", toNanoseconds(each.time)},
          {"withdrawn", each.withdrawn}};
}

std::string lineOf(const Correction& each) {
  const std::string about = each.aboutTwo() ? fmt::format("{} and {}", each.object, each.other)
                                            : std::to_string(each.object);
  return fmt::format("{:>4}  {:<10} {:<13} {:<14} {:>6.1f} nats  {}{}\n", each.id,
                     nameOf(each.kind), about, each.class_name, each.nats, each.author,
                     each.withdrawn ? "  (withdrawn)" : "");
}

void run(CorrectCommand& command) {
  Correction& correction = command.correction;
  if (command.same_as != 0) correction.kind = CorrectionKind::kSame;
  if (command.different_from != 0) correction.kind = CorrectionKind::kDifferent;
  if (!correction.class_name.empty()) correction.kind = CorrectionKind::kClass;
  correction.other = std::max(command.same_as, command.different_from);
  correction.withdrawn = correction.id != 0;
  if (!command.list && !correction.withdrawn && correction.object == 0) {
    throw StartupError(ExitCode::kUsage, "give the ID of the object; `perdure map list` shows it");
  }
  const MapReply reply = ask(command);
  if (!reply.ok) throw StartupError(ExitCode::kFailure, reply.error);
  auto json = nlohmann::ordered_json::array();
  for (const Correction& each : reply.corrections) json.push_back(jsonOf(each));
  if (command.json) std::cout << json.dump(1) << "\n";
  for (const Correction& each : reply.corrections) {
    if (!command.json) std::cout << lineOf(each);
  }
}

}  // namespace

void addCorrectCommand(CLI::App& map) {
  auto given = std::make_shared<CorrectCommand>();
  const char* user = std::getenv("USER");
  given->correction.author = user != nullptr ? user : std::to_string(getuid());
  CLI::App* command = map.add_subcommand("correct",
                                         "States that the map is wrong about an object; --withdraw "
                                         "takes it back");
  Correction& correction = given->correction;
  command->add_option("ID", correction.object, "the object's id")->check(CLI::PositiveNumber);
  CLI::Option_group* what = command->add_option_group("what is stated");
  what->require_option(1);
  what->add_flag("--not-there", given->not_there, "the object does not exist");
  what->add_option("--class", correction.class_name, "its right class")
      ->type_name("NAME")
      ->check([](const std::string& name) {
        return name.empty() ? "give the name of a class" : std::string();
      });
  what->add_option("--same-as", given->same_as, "it is the same as this object")
      ->type_name("ID")
      ->check(CLI::PositiveNumber);
  what->add_option("--different-from", given->different_from,
                   "this object, or a track merged into it, is another one")
      ->type_name("ID")
      ->check(CLI::PositiveNumber);
  what->add_option("--withdraw", correction.id, "takes the correction with this number back")
      ->check(CLI::PositiveNumber);
  what->add_flag("--list", given->list, "shows the standing corrections");
  command
      ->add_option("--nats", correction.nats,
                   "log-likelihood ratio of the statement; without: map_store's corrections.nats")
      ->check(CLI::Range(0.01, kMostCorrectionNats));
  command->add_option("--author", correction.author, "who states it; without: the user's name")
      ->check([](const std::string& name) {
        const bool sent = name.size() <= wire::kNameLength && wire::isText(name);
        return sent ? std::string() : "the name is longer than 256 bytes, or not UTF-8 text";
      });
  command->add_flag("--json", given->json, "as JSON");
  addPlace(*command, given->place);
  command->callback([given] { run(*given); });
}

}  // namespace perdure::tools
