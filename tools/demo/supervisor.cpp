#include "tools/demo/supervisor.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <sstream>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "common/base/files/access.h"

namespace perdure::tools {
namespace {

constexpr std::chrono::seconds kPatienceAtEnd{5};

/// The last line of a service's log that is not an info message.
std::string lastWords(const std::string& log_file) {
  std::istringstream lines(textOf(log_file));
  std::string last, line;
  while (std::getline(lines, line)) {
    if (!line.empty() && line.find(" info: ") == std::string::npos) last = line;
  }
  return last;
}

bool meansCannotStart(int status) {
  return status == static_cast<int>(ExitCode::kUsage) ||
         status == static_cast<int>(ExitCode::kUnavailable) ||
         status == static_cast<int>(ExitCode::kConfiguration);
}

[[noreturn]] void refuse(const ServicePlan& service, int status) {
  const std::string words = lastWords(service.log);
  throw StartupError(status == 0 ? ExitCode::kFailure : static_cast<ExitCode>(status),
                     "{} does not start: {} (its log: {})", service.name,
                     words.empty() ? "it ends in its first second" : words, service.log);
}

}  // namespace

Supervisor::Supervisor(const std::vector<ServicePlan>& services,
                       const std::filesystem::path& folder)
    : folder_(folder) {
  for (const ServicePlan& service : services) {
    programs_.emplace_back().plan = service;
    start(programs_.back());
  }
}

Supervisor::~Supervisor() {
  for (const Program& program : programs_) {
    if (program.process) program.process->signal(SIGTERM);
  }
  for (Program& program : programs_) {
    if (program.process) program.process->stop(kPatienceAtEnd);
  }
}

/// Starts the service in its own session, so that only this program receives Ctrl-C.
void Supervisor::start(Program& program) {
  program.process.emplace(ProgramOptions{.command = program.plan.command,
                                         .folder = folder_,
                                         .log = program.plan.log,
                                         .own_session = true,
                                         .ends_with_parent = true});
  program.started = Clock::now();
  program.again.reset();
  ++program.starts;
}

void Supervisor::watch() {
  using namespace std::chrono_literals;
  constexpr int kTries = 5;
  for (Program& program : programs_) {
    const auto status = program.process->ended();
    if (!status || program.stopped) continue;
    const auto now = Clock::now();
    if (!program.again) {
      const bool had_started = now - program.started >= 1s;
      program.stopped = had_started && *status == 0;
      program.failures = had_started ? 0 : program.failures + 1;
      const bool hopeless = program.failures >= kTries || meansCannotStart(*status);
      if (!had_started && hopeless) refuse(program.plan, *status);
      program.again = now + program.failures * 1s;
    }
    if (!program.stopped && now >= *program.again) start(program);
  }
}

Supervisor::Program& Supervisor::named(const std::string& service) {
  const auto found =
      std::ranges::find_if(programs_, [&](const Program& one) { return one.plan.name == service; });
  check(found != programs_.end(), "the service was started");
  return *found;
}

void Supervisor::stop(const std::string& service) {
  Program& program = named(service);
  program.stopped = true;
  program.process->signal(SIGTERM);
}

bool Supervisor::runs(const std::string& service) { return !named(service).process->ended(); }

int Supervisor::starts(const std::string& service) const {
  for (const Program& one : programs_) {
    if (one.plan.name == service) return one.starts;
  }
  return 0;
}

}  // namespace perdure::tools
