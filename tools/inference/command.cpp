#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include "common/base/errors.h"
#include "common/base/subprocess.h"
#include "common/service/signals.h"
#include "tools/bus_tools/common.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSwapHelp = R"(
Starts perdure-inference with another network beside the one that runs. It rehearses unheard, takes
`detections` over, is watched by the old one for the probation, and then tells it to retire. Where
it dies, stalls or says nonsense (nothing or NaN where the old one sees, boxes elsewhere, ten times
the boxes) the old one takes back by itself. The two settle that between them over DDS: when this
command is killed half way, nothing is lost but its report. Ctrl-C before the end rolls back.

  perdure inference swap --model new.onnx --config config/inference.yaml
  perdure echo inference/swap                      what the two say to each other

Exit status 0: the new one serves. 1: it does not, and the old one does.)";

struct SwapRequest {
  bus::Options bus;
  std::string model, config, log, program;
  double probation_s = 30.0, patience_s = 60.0;
  std::vector<std::string> settings;
};

std::vector<std::string> commandOf(const SwapRequest& request) {
  std::vector<std::string> command = {request.program};
  const auto set = [&](const std::string& assignment) {
    command.insert(command.end(), {"--set", assignment});
  };
  if (!request.config.empty()) command.insert(command.end(), {"--config", request.config});
  for (const std::string& setting : request.settings) set(setting);
  set("model.path=" + fs::absolute(request.model).string());
  set(fmt::format("ownership.probation_s={}", request.probation_s));
  const bus::Options usual;
  if (request.bus.interface != usual.interface) set("bus.interface=" + request.bus.interface);
  if (request.bus.vehicle != usual.vehicle) set("bus.vehicle=" + request.bus.vehicle);
  if (request.bus.security != usual.security) set("bus.security=" + request.bus.security);
  if (request.bus.domain != usual.domain) set(fmt::format("bus.domain={}", request.bus.domain));
  return command;
}

/// Follows a swap from the messages of the two processes, and prints its progress.
class Report {
 public:
  enum class End { kNone, kServes, kRolledBack };
  explicit Report(pid_t newcomer) : newcomer_(static_cast<std::uint32_t>(newcomer)) {}

  void onHealth(const Health& health) {
    if (health.process != "inference") return;
    pids_[health.instance] = health.pid;
    if (health.pid != newcomer_ || instance_ != 0) return;
    instance_ = health.instance;
    for (const SwapNotice& notice : std::exchange(early_, {})) onNotice(notice);
  }
  void onNotice(const SwapNotice& n) {
    if (instance_ == 0) return early_.push_back(n);
    if (n.instance == instance_) return ofNewcomer(n);
    if (n.about != instance_) return;
    if (n.step == SwapStep::kRetired) {
      say("retires", nameOf(n.instance) + "; " + n.detail);
      end_ = End::kServes;
    }
    if (n.step == SwapStep::kRolledBack) rolledBack(n, "by " + nameOf(n.instance));
  }
  End end() const { return end_; }
  bool tookOver() const { return took_over_; }
  bool passed() const { return passed_; }
  std::string elder() const { return nameOf(elder_); }

 private:
  void ofNewcomer(const SwapNotice& n) {
    switch (n.step) {
      case SwapStep::kRehearsing:
        return say("rehearses", n.model + ", unheard");
      case SwapStep::kTookOver:
        took_over_ = true;
        elder_ = n.about;
        if (n.about == 0) return say("took over", "nobody was heard");
        return say("took over", fmt::format("from {}; rehearsal: {}; watched for {} s",
                                            nameOf(n.about), n.detail, n.probation_s));
      case SwapStep::kPassed:
        passed_ = true;
        if (n.about == 0) end_ = End::kServes;
        return n.about == 0 ? void() : say("passed", "its probation");
      case SwapStep::kRolledBack:
        return rolledBack(n, "by itself");
      case SwapStep::kRetired:
        return;
    }
  }
  void rolledBack(const SwapNotice& n, const std::string& by) {
    say("rolled back", fmt::format("{}, {}: {}", by, n.reason, n.detail));
    end_ = End::kRolledBack;
  }
  std::string nameOf(InstanceId instance) const {
    const auto it = pids_.find(instance);
    return it == pids_.end() ? toHex(instance)
                             : fmt::format("{} (pid {})", toHex(instance), it->second);
  }
  static void say(const char* what, const std::string& text) {
    std::printf("%-12s%s\n", what, text.c_str());
    std::fflush(stdout);
  }

  std::uint32_t newcomer_;
  InstanceId instance_ = 0, elder_ = 0;
  std::map<InstanceId, std::uint32_t> pids_;
  std::vector<SwapNotice> early_;
  bool took_over_ = false, passed_ = false;
  End end_ = End::kNone;
};

/// Returns the last line of a process's log, which explains why the process ended.
std::string lastLineOf(const std::string& log) {
  std::ifstream file(log);
  std::string last;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

/// Runs the loop until the swap has succeeded or failed. Returns the error, or an empty text.
std::string follow(bus::WaitLoop& loop, const SwapRequest& request, Subprocess& newcomer,
                   const Report& report) {
  using Clock = std::chrono::steady_clock;
  const auto after = [](double seconds) { return Clock::now() + durationFromSeconds(seconds); };
  const auto latest = after(request.patience_s);
  std::optional<Clock::time_point> last_word;
  std::string problem;
  loop.every(std::chrono::milliseconds(50), [&] {
    const auto now = Clock::now();
    if (report.end() != Report::End::kNone) return loop.stop();
    if (newcomer.ended()) {
      problem = lastLineOf(request.log);
      return loop.stop();
    }
    if (!report.tookOver() && now > latest) {
      problem = fmt::format(
          "it did not take over within {} s; do frames come? perdure hz "
          "frame/cam0; --patience waits longer",
          request.patience_s);
      return loop.stop();
    }
    if (!report.passed()) return;
    constexpr double kLastWord = 5.0;
    if (!last_word) last_word = after(kLastWord);
    if (now > *last_word) loop.stop();
  });
  loop.run();
  return problem;
}

void runSwap(SwapRequest request) {
  if (request.program.empty()) request.program = (programFolder() / "perdure-inference").string();
  for (const std::string& file : {request.program, request.model}) {
    if (!fs::exists(file)) throw StartupError(ExitCode::kUnavailable, file + " is missing");
  }
  if (request.log.empty()) {
    request.log =
        (fs::temp_directory_path() / fmt::format("perdure-inference-{}.log", getpid())).string();
  }
  const service::BlockedSignals blocked;
  const bus::Domain domain(request.bus);
  const bus::Participant participant(domain, "perdure inference swap");
  bus::Reader<SwapNotice> notices(participant, bus::kTopic<SwapNotice>);
  bus::Reader<Health> health(participant, bus::kTopic<Health>);
  bus::WaitLoop loop(participant);
  Subprocess newcomer({.command = commandOf(request), .log = request.log, .own_session = true});
  newcomer.leaveAlone();  // the new process continues after this command
  std::printf("%-12spid %d, log %s\n", "started", newcomer.pid(), request.log.c_str());
  std::fflush(stdout);
  Report report(newcomer.pid());
  loop.on(health, [&](const Health& m) { report.onHealth(m); });
  loop.on(notices, [&](const SwapNotice& m) { report.onNotice(m); });
  std::atomic<bool> interrupted = false;
  const service::SignalThread signals(blocked, [&] {
    interrupted = true;
    loop.stop();
  });
  const std::string problem = follow(loop, request, newcomer, report);
  if (report.end() == Report::End::kServes) {
    std::printf("%-12spid %d goes on; after a restart the configuration's model.path holds\n",
                "serves", newcomer.pid());
    return;
  }
  if (report.passed() && !newcomer.ended()) {
    throw StartupError(
        ExitCode::kFailure,
        fmt::format("the new one serves, but {} does not retire; end it by hand", report.elder()));
  }
  newcomer.stop(std::chrono::seconds(5));
  throw StartupError(ExitCode::kFailure, interrupted ? "interrupted, rolled back"
                                                     : "rolled back" +
                                                           (problem.empty() ? "" : ": " + problem) +
                                                           " (log: " + request.log + ")");
}

}  // namespace

void setUpInference(CLI::App& inference) {
  inference.require_subcommand(1);
  CLI::App* command =
      inference.add_subcommand("swap", "another network takes over while frames go on");
  command->footer(kSwapHelp);
  auto request = std::make_shared<SwapRequest>();
  command->add_option("--model", request->model, "the new network: .onnx, or a Darknet .cfg")
      ->required()
      ->type_name("FILE");
  command->add_option("--probation", request->probation_s, "for so long the old one watches it, s")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  command->add_option("--config", request->config, "configuration of the new process")
      ->type_name("FILE");
  command->add_option("--set", request->settings, "one value of it; may be repeated")
      ->type_name("KEY=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--patience", request->patience_s, "to wait for it to take over, s")
      ->capture_default_str();
  command->add_option("--log", request->log, "where the new process logs")->type_name("FILE");
  command->add_option("--program", request->program, "perdure-inference; default: beside this one")
      ->type_name("FILE");
  addBusOptions(*command, request->bus);
  command->callback([request] { runSwap(*request); });
}

}  // namespace perdure::tools
