#include "common/service/service.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>

#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/bus/security_log.h"
#include "common/service/process.h"
#include "common/service/signals.h"
#include "common/types/health.h"

namespace perdure::service {
namespace {

struct Common {
  bus::Options bus;
  std::string log_level = "info";
};

void describe(Common& common, config::Fields& fields) {
  bus::describe(common.bus, fields);
  fields.choice("log.level", common.log_level,
                {"trace", "debug", "info", "warning", "error", "off"},
                {"how much is logged to standard error"});
}

/// Returns the name of the executable: "semantic_filter" gives "perdure-semantic-filter".
std::string executableOf(const Program& program) {
  std::string name = "perdure-" + program.process;
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

struct CommandLine {
  std::string config_file;
  std::vector<std::string> assignments;
  bool check_config = false, print_config = false, markdown = false;
};

void addOptions(CLI::App& app, CommandLine& line) {
  app.add_option("--config", line.config_file, "YAML file; --print-config shows what it may hold")
      ->type_name("FILE");
  app.add_option("--set", line.assignments, "one value, after the file; may be repeated")
      ->type_name("KEY=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  app.add_flag("--check-config", line.check_config,
               "read the configuration, report all that is wrong, and exit (78 or 0)");
  app.add_flag("--print-config", line.print_config, "print the configuration in force and exit");
  app.add_flag("--print-config-table", line.markdown,
               "print the fields as the Markdown table of the README and exit");
  app.set_version_flag("--version", std::string(PERDURE_VERSION));
}

/// Returns the options shared by all services of this host, from bus.yaml beside the service's
/// file.
bus::Options commonBus(const CommandLine& line, std::vector<config::Problem>& problems) {
  const auto folder = std::filesystem::path(line.config_file).parent_path();
  const bool beside = !line.config_file.empty();
  return bus::commonOptions(beside ? (folder.empty() ? "." : folder.string()) : "", problems);
}

/// Reads the configuration file and the assignments of the command line. Throws StartupError with
/// all errors, including `problems`.
void readConfiguration(config::Fields& fields, const CommandLine& line,
                       std::vector<config::Problem> problems) {
  const auto append = [&](std::vector<config::Problem> more) {
    problems.insert(problems.end(), more.begin(), more.end());
  };
  if (!line.config_file.empty()) append(config::readFile(fields, line.config_file));
  for (const std::string& assignment : line.assignments) append(assign(fields, assignment));
  append(missing(fields, line.config_file.empty() ? "configuration" : line.config_file));
  config::refuse(problems);
}

/// Does everything that follows the reading of the command line. Throws StartupError.
void start(const Program& program, const CommandLine& line) {
  const BlockedSignals blocked;
  Common common;
  config::Fields fields;
  if (program.describe) program.describe(fields);
  describe(common, fields);
  if (line.markdown) {
    std::cout << config::toMarkdown(fields);
    return;
  }
  std::vector<config::Problem> problems;
  common.bus = commonBus(line, problems);
  readConfiguration(fields, line, std::move(problems));
  if (program.verify) program.verify();
  if (line.print_config) std::cout << config::toYaml(fields);
  if (line.check_config || line.print_config) return;

  Context context(program.process, common.bus, makeLog(program.process, common.log_level));
  const SignalThread signals(blocked, [&] { context.stop(); });
  context.log().info("version {}, instance {}, configuration {}", PERDURE_VERSION,
                     toHex(context.instance()), toHex(digest(config::toYaml(fields))));
  program.body(context);
  context.log().info("ends");
}

}  // namespace

std::shared_ptr<spdlog::logger> makeLog(const std::string& process, const std::string& level) {
  auto log =
      std::make_shared<spdlog::logger>(process, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  log->set_pattern("%Y-%m-%d %H:%M:%S.%e %n %l: %v");
  log->set_level(spdlog::level::from_str(level));
  log->flush_on(spdlog::level::trace);
  return log;
}

Context::Context(const std::string& process, const bus::Domain& domain,
                 std::shared_ptr<spdlog::logger> log)
    : instance_(makeInstanceId()),
      log_(std::move(log)),
      domain_(domain),
      participant_(domain_, process),
      health_(process, instance_),
      health_writer_(participant_, bus::kTopic<Health>),
      loop_(participant_) {
  countReasons([this](ReasonCounts& counts) {
    health_writer_.report(counts);
    if (participant_.identity()) bus::securityLog().report(counts);
    if (clock_steps_.count() > 0) counts.add("wall_clock_stepped", clock_steps_.count());
    if (clock_steps_.recent()) counts.add("wall_clock_stepped_just_now");
  });
  every(std::chrono::seconds(1), [this] { publishHealth(); });
  noteSharedMemory();
  publishHealth();
}

Context::~Context() = default;

void Context::countReasons(std::function<void(ReasonCounts&)> source) {
  reason_sources_.push_back(std::move(source));
}

void Context::countReasons(std::function<const ReasonCounts&()> source) {
  reason_sources_.push_back(
      [source = std::move(source)](ReasonCounts& counts) { counts.add(source()); });
}

void Context::run() {
  if (health_.sample(std::chrono::steady_clock::now()).state == HealthState::kStarting) {
    health_.state(HealthState::kOk);
  }
  notifyReady();
  publishHealth();
  runLoop();
  notifyStopping();
  publishHealth();
}

/// Each completed iteration feeds the watchdog, which therefore ends a process that hangs or is
/// stopped.
void Context::runLoop() {
  constexpr std::chrono::microseconds kLongest{1'000'000};
  Watchdog watchdog;
  const auto longest =
      watchdog.period().count() > 0 ? std::min(kLongest, watchdog.period()) : kLongest;
  while (!loop_.stopped()) {
    loop_.runOnce(longest);
    requireIdentity();
    const bool lives = std::all_of(watched_.begin(), watched_.end(),
                                   [](const auto& goes_on) { return goes_on(); });
    if (lives) watchdog.feed(std::chrono::steady_clock::now());
  }
}

ReasonCounts Context::reasons() const {
  ReasonCounts counts;
  for (const auto& source : reason_sources_) source(counts);
  return counts;
}

/// Logs the detail of the first refusal of each kind. Health only counts refusals.
void Context::logNewRefusals() {
  for (const auto& endpoint : endpoints_) {
    for (const auto& [count, detail] : endpoint->firstDetails()) {
      if (logged_refusals_.insert(count).second) log_->warn("{}, first: {}", count, detail);
    }
  }
  if (!participant_.identity()) return;
  const auto shut_out = bus::securityLog().firstDetails();
  for (const auto& [count, detail] : shut_out) {
    if (logged_refusals_.insert(count).second) log_->warn("{}, first: {}", count, detail);
  }
}

/// Logs changes of shared memory, because RouDi may stop and start while the services run.
void Context::noteSharedMemory() {
  const std::string text = domain_.sharedMemoryText();
  if (text == shared_memory_) return;
  shared_memory_ = text;
  log_->log(domain_.sharedMemory().on() ? spdlog::level::info : spdlog::level::warn, "{}", text);
}

/// Throws StartupError if the identity is no longer valid. Cyclone disconnects a process when its
/// identity expires; after a restart it uses the renewed one.
void Context::requireIdentity() const {
  const auto& identity = participant_.identity();
  if (!identity || identity->until > std::chrono::system_clock::now()) return;
  throw std::runtime_error("the identity " + identity->name +
                           " has ended; `perdure security renew`, and its folder here");
}

/// Returns a text if the identity expires soon; otherwise "".
std::string Context::identityEnds() const {
  const auto& identity = participant_.identity();
  if (!identity || identity->until - std::chrono::system_clock::now() > bus::kRenewBefore)
    return {};
  return "the identity " + identity->name + " ends " + bus::fromNow(identity->until) +
         "; `perdure security renew`, then restart the service";
}

/// Publishes Health at once if an input stops or resumes.
void Context::noteSilence() {
  const auto now = Input::Clock::now();
  const auto silent = static_cast<std::size_t>(std::count_if(
      inputs_.begin(), inputs_.end(), [&](const Input& input) { return input.silent(now); }));
  if (silent != silent_inputs_) publishHealth();
  silent_inputs_ = silent;
}

/// Returns a text about the silent inputs; "" if no input is silent.
std::string Context::silence() const {
  const auto now = Input::Clock::now();
  std::string text;
  for (const Input& input : inputs_) {
    if (!input.silent(now)) continue;
    text += (text.empty() ? "" : "; ") + input.sentence(now);
  }
  return text;
}

void Context::publishHealth() {
  logNewRefusals();
  noteSharedMemory();
  clock_steps_.look();
  if (on_health_) on_health_();
  Health health = health_.sample(std::chrono::steady_clock::now());
  const bool misses = !shared_memory_.empty() && !domain_.sharesMemory();
  const std::string ending = identityEnds();
  if ((misses || !ending.empty()) && health.state == HealthState::kOk) {
    health.state = HealthState::kDegraded;
  }
  const std::string& besides = ending.empty() ? shared_memory_ : ending;
  if (health.message.empty()) {
    health.message = besides;
  } else if (misses || !ending.empty()) {
    health.message = besides + "; " + health.message;
  }
  const std::string silent = silence();
  const bool well_but_silent = !silent.empty() && health.state == HealthState::kOk;
  if (!silent.empty() && health.state != HealthState::kFailed) {
    // The message of an earlier error stays, because the error may be the cause of the silence.
    const bool well = health.state == HealthState::kOk || health.message.empty();
    health.message = well ? silent : health.message + "; " + silent;
    health.state = HealthState::kDegraded;
  }
  health.reasons = reasons().all();
  if (well_but_silent) health.reasons[kInputSilent] = 1;
  (void)health_writer_.write(health);
}

void Context::onCalibration(const Sink<Calibration>& use) {
  const auto refined = std::make_shared<std::optional<InstanceId>>();
  on(bus::kTopic<Calibration>, [refined, use](const Calibration& m) {
    if (*refined != m.source) use(m);
  });
  on(bus::kEstimatedCalibration, [refined, use](const Calibration& m) {
    *refined = m.source;
    use(m);
  });
}

int runService(int argc, char** argv, const Program& program) {
  CLI::App app(program.summary, executableOf(program));
  CommandLine line;
  addOptions(app, line);
  for (const Shorthand& shorthand : program.shorthands) {
    app.add_option_function<std::string>(
           shorthand.option,
           [&line, &shorthand](const std::string& value) {
             line.assignments.push_back(shorthand.key + "=" + value);
           },
           "the same as --set " + shorthand.key + "=" + shorthand.type)
        ->type_name(shorthand.type);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  try {
    start(program, line);
    return static_cast<int>(ExitCode::kOk);
  } catch (const StartupError& error) {
    std::cerr << error.what() << '\n';
    return static_cast<int>(error.code());
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string forbidden = whyUnreadable(error.path1());
    std::cerr << executableOf(program)
              << " ends: " << (forbidden.empty() ? error.what() : forbidden) << '\n';
    return static_cast<int>(ExitCode::kUnavailable);
  } catch (const std::exception& error) {
    std::cerr << executableOf(program) << " ends by an error: " << error.what() << '\n';
    return static_cast<int>(ExitCode::kFailure);
  }
}

}  // namespace perdure::service
