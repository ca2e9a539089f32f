#include "tools/map/look_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "tools/map/look.h"

namespace perdure::tools {
namespace {

using semantic_filter::Fall;

constexpr double kDegree = std::numbers::pi / 180.0;

struct LookCommand {
  std::string map, rig, config, poses, route;
  std::vector<double> pose, around;
  std::vector<std::string> parts;
  double after_s = 0.0;
  std::size_t most = 10;
  bool json = false;
};

/// A part of the expected fall, as --by names it.
struct Part {
  const char* name;
  double Fall::*bits;
};
constexpr Part kParts[] = {{"existence", &Fall::existence},
                           {"class", &Fall::classes},
                           {"position", &Fall::position},
                           {"unseen", &Fall::unseen}};

double valueOf(const Fall& fall, const std::vector<std::string>& parts) {
  if (parts.empty()) return fall.total();
  double value = 0.0;
  for (const Part& part : kParts) {
    if (std::find(parts.begin(), parts.end(), part.name) != parts.end()) value += fall.*part.bits;
  }
  return value;
}

std::vector<TimedView> viewsOf(const LookCommand& command, const MapToLook& map, TimePoint at) {
  if (!command.poses.empty()) {
    auto views = readPlan(command.poses, at);
    for (TimedView& view : views) view.time = at;
    return views;
  }
  if (!command.around.empty()) {
    const auto& a = command.around;
    if (a[2] <= 0.0) {
      throw StartupError(ExitCode::kUsage,
                         fmt::format("--around: a radius of {} m is not above 0", a[2]));
    }
    auto views = posesAround(map, {a[0], a[1]}, a[2], at);
    if (views.empty()) {
      throw StartupError(ExitCode::kData,
                         fmt::format("{}: no anchor lies within {} m of {} {}; give a larger "
                                     "radius, or poses with --pose or --poses",
                                     command.map, a[2], a[0], a[1]));
    }
    return views;
  }
  const auto& p = command.pose;
  const Eigen::AngleAxisd yaw(p[3] * kDegree, Eigen::Vector3d::UnitZ());
  return {{{Eigen::Quaterniond(yaw), {p[0], p[1], p[2]}}, at}};
}

std::vector<std::vector<TimedView>> plansOf(const LookCommand& command, const MapToLook& map) {
  const TimePoint at = map.newest + durationFromSeconds(command.after_s);
  if (!command.route.empty()) return {readPlan(command.route, at)};
  std::vector<std::vector<TimedView>> plans;
  for (const TimedView& view : viewsOf(command, map, at)) plans.push_back({view});
  return plans;
}

std::string objectsOf(const Prospect& prospect) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t k = 0; k < std::min(kShown, prospect.objects.size()); ++k) {
    const auto& o = prospect.objects[k];
    text += fmt::format("{}{} {} ({:.2f})", k == 0 ? "" : ", ", o.class_name, o.id, o.existence);
  }
  return text;
}

std::string tableOf(const std::vector<Prospect>& prospects, const LookCommand& command) {
  std::string text = fmt::format("{:>8} {:>9} {:>7} {:>9} {:>7} {:>7} {:>9} {:>9} {:>6}  {}\n",
                                 "bits", "existence", "class", "position", "unseen", "metres", "x",
                                 "y", "yaw", "objects (existence)");
  for (const Prospect& p : prospects) {
    const RigidTransform& T = p.views.front().T_WB;
    text += fmt::format(
        "{:>8.2f} {:>9.2f} {:>7.2f} {:>9.2f} {:>7.2f} {:>7.0f} {:>9.2f} {:>9.2f} {:>6.0f}  {}\n",
        valueOf(p.fall, command.parts), p.fall.existence, p.fall.classes, p.fall.position,
        p.fall.unseen, p.length_m(), T.p.x(), T.p.y(), yawOf(T.R()) / kDegree, objectsOf(p));
  }
  return text;
}

void warnWhatIsMissing(const LookCommand& command, const MapToLook& map) {
  if (map.beliefs.empty()) {
    throw StartupError(ExitCode::kData, command.map +
                                            ": the map has no object at rest, so nothing is known "
                                            "of what a pose would show; record a drive first");
  }
  if (map.past.empty()) {
    std::cerr << "perdure map: " << command.map
              << " has no graph, so places that were never seen are not counted; set "
                 "graph.enabled=true in map_store.yaml\n";
  }
}

void look(const LookCommand& command) {
  const LookSettings settings = readLookSettings(command.rig, command.config);
  const MapToLook map = readMapToLook(command.map);
  warnWhatIsMissing(command, map);
  auto prospects = prospectsOf(map, plansOf(command, map), settings);
  std::stable_sort(prospects.begin(), prospects.end(), [&](auto& a, auto& b) {
    return valueOf(a.fall, command.parts) > valueOf(b.fall, command.parts);
  });
  if (prospects.size() > command.most) prospects.resize(command.most);
  if (command.json) {
    auto list = nlohmann::ordered_json::array();
    for (const Prospect& p : prospects) list.push_back(toJson(p));
    std::cout << nlohmann::ordered_json{{"prospects", list}}.dump(1) << "\n";
    return;
  }
  std::cout << tableOf(prospects, command);
}

}  // namespace

void addLookCommand(CLI::App& map) {
  auto given = std::make_shared<LookCommand>();
  CLI::App* command = map.add_subcommand("look", "Where to look next: expected information");
  command->add_option("MAP", given->map, "the map's file, which is only read")->required();
  command
      ->add_option("--rig", given->rig,
                   "the camera: a rig file of `perdure calibrate`, or a drive (folder or .mcap)")
      ->required();
  CLI::Option_group* what = command->add_option_group("what is evaluated");
  what->require_option(1);
  what->add_option("--pose", given->pose, "X Y Z YAW of the body in M, m and degrees")->expected(4);
  what->add_option("--poses", given->poses, "ranks the poses of TUM lines")->type_name("FILE");
  what->add_option("--route", given->route, "the poses of TUM lines as one route")
      ->type_name("FILE");
  what->add_option("--around", given->around,
                   "X Y R: ranks poses at anchors within R metres, in eight directions")
      ->expected(3);
  command
      ->add_option("--by", given->parts,
                   "ranks by these parts only: existence, class, position, unseen")
      ->delimiter(',')
      ->check(CLI::IsMember({"existence", "class", "position", "unseen"}));
  command->add_option("--after", given->after_s, "seconds after the newest data of the map")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--most", given->most, "shows at most so many poses")
      ->check(CLI::PositiveNumber);
  command->add_option("--config", given->config, "the semantic filter's configuration")
      ->type_name("FILE");
  command->add_flag("--json", given->json, "as JSON");
  command->callback([given] { look(*given); });
}

}  // namespace perdure::tools
