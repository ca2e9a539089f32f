#include "tools/demo/plan.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <charconv>
#include <fstream>

#include "common/base/errors.h"
#include "common/config/fields.h"
#include "services/semantic_filter/priors.h"
#include "tools/demo/truth.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

// A folder with this file is a run folder of the demo, which may be emptied.
constexpr char kMark[] = "capture.log";

[[noreturn]] void cannotUse(const fs::path& folder, const std::string& why) {
  throw StartupError(ExitCode::kUnavailable, "{} cannot be used: {}; give --out another folder",
                     folder.string(), why);
}

/// The "--set" arguments that make capture replay at the pace of --rate.
std::vector<std::string> paceOf(const std::string& rate) {
  if (rate == "max") return {"pace.mode=follow"};
  double value = 0.0;
  const auto [end, error] = std::from_chars(rate.data(), rate.data() + rate.size(), value);
  if (error != std::errc() || end != rate.data() + rate.size() || !(value > 0.0)) {
    throw StartupError(ExitCode::kUsage, fmt::format("--rate {}: give max, or how many seconds of "
                                                     "the drive pass in one second",
                                                     rate));
  }
  return {"pace.mode=clock", "pace.rate=" + rate};
}

std::string programName(const std::string& service) {
  std::string name = "perdure-" + service;
  for (char& c : name) {
    if (c == '_') c = '-';
  }
  return name;
}

std::vector<std::string> settingsOf(const std::string& service, const DemoOptions& options,
                                    const DemoFolders& folders) {
  if (service == "map_store") return {"store.path=" + (folders.state / "map.sqlite").string()};
  if (service == "vio") {
    std::vector<std::string> settings = {"state.directory=" + folders.state.string()};
    // A simulated drive with wheel speed is that of a car, which does not slip sideways or jump.
    const bool car = isSimulated(options.data) &&
                     fs::exists(fs::path(options.data) / "mav0" / "speed0" / "data.csv");
    if (car) settings.push_back("speed.planar=true");
    return settings;
  }
  if (service == "inference") return {"model.path=" + fs::absolute(options.model).string()};
  if (service != "capture") return {};
  std::vector<std::string> settings = {
      "dataset.path=" + fs::absolute(options.data).string(),
      "run.state=" + (folders.state / "capture.json").string(), "run.on_end=stay",
      "start.readers=[vio, inference, semantic_filter, map_store, demo]"};
  if (!options.sequence.empty()) {
    settings.push_back(fmt::format("dataset.sequence=\"{}\"", options.sequence));
  }
  if (!options.rig.empty()) settings.push_back("rig=" + fs::absolute(options.rig).string());
  if (!options.topics.empty()) {
    settings.push_back(fmt::format("dataset.topics=[{}]", fmt::join(options.topics, ", ")));
  }
  for (std::string& setting : paceOf(options.rate)) settings.push_back(std::move(setting));
  return settings;
}

ServicePlan planOf(const std::string& name, const DemoOptions& options, const DemoFolders& folders,
                   std::vector<std::string> settings) {
  const fs::path program = fs::absolute(options.programs) / programName(name);
  ServicePlan plan{name, {program.string()}, (folders.run / (name + ".log")).string()};
  const fs::path config = fs::absolute(options.root) / "config" / (name + ".yaml");
  if (fs::exists(config)) plan.command.insert(plan.command.end(), {"--config", config.string()});
  if (options.shared_memory_mb > 0) {
    settings.push_back(fmt::format("bus.shared_memory_mb={}", options.shared_memory_mb));
  }
  for (const std::string& setting : settings) {
    plan.command.insert(plan.command.end(), {"--set", setting});
  }
  return plan;
}

}  // namespace

DemoFolders prepareFolders(const DemoOptions& options) {
  DemoFolders folders;
  folders.out = fs::absolute(options.out);
  folders.lock = std::make_unique<FolderLock>(folders.out);
  folders.run = folders.out / "run";
  folders.state = folders.run / "state";
  std::error_code error;
  if (fs::exists(folders.run)) {
    if (!fs::exists(folders.run / kMark)) {
      cannotUse(folders.run, "it was not made by a demo, so it is not emptied");
    }
    fs::remove_all(folders.run, error);
  }
  fs::create_directories(folders.state, error);
  if (error) cannotUse(folders.out, error.message());
  std::ofstream(folders.run / kMark) << "";
  return folders;
}

std::map<std::string, std::vector<Eigen::Vector3d>> shapesFor(const DemoOptions& options) {
  const fs::path root = fs::absolute(options.root);
  semantic_filter::Config config;
  config::Fields fields;
  semantic_filter::describe(config, fields);
  const fs::path file = root / "config" / "semantic_filter.yaml";
  if (fs::exists(file)) config::refuse(config::readFile(fields, file.string()));
  return semantic_filter::shapePoints(
      semantic_filter::loadClassPriors((root / config.class_priors).string()));
}

std::vector<ServicePlan> planServices(const DemoOptions& options, const DemoFolders& folders) {
  std::vector<ServicePlan> plans;
  for (const std::string name : kServices) {
    const fs::path program = fs::absolute(options.programs) / programName(name);
    if (!fs::exists(program)) {
      throw StartupError(ExitCode::kUnavailable,
                         fmt::format("{} is missing; build it: cmake --preset release && cmake "
                                     "--build --preset release",
                                     program.string()));
    }
    plans.push_back(planOf(name, options, folders, settingsOf(name, options, folders)));
  }
  return plans;
}

std::optional<ServicePlan> planGateway(const DemoOptions& options, const DemoFolders& folders,
                                       std::uint16_t port) {
  if (!fs::exists(fs::absolute(options.programs) / programName(kGateway))) return std::nullopt;
  std::vector<std::string> settings = {fmt::format("http.port={}", port)};
  if (isSimulated(options.data)) {
    const fs::path truth = folders.run / "truth.json";
    if (writeTruthForPage(options.data, truth)) settings.push_back("page.truth=" + truth.string());
  }
  return planOf(kGateway, options, folders, settings);
}

std::uint16_t freePort() {
  constexpr std::uint16_t kUsual = 8765;
  for (const std::uint16_t wanted : {kUsual, std::uint16_t{0}}) {
    const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int yes = 1;
    setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(wanted);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    const bool free = bind(file, any, size) == 0 && getsockname(file, any, &size) == 0;
    close(file);
    if (free) return ntohs(address.sin_port);
  }
  return kUsual;
}

}  // namespace perdure::tools
