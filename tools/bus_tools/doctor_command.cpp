#include <algorithm>
#include <iostream>
#include <memory>

#include "tools/bus_tools/command.h"
#include "tools/bus_tools/common.h"
#include "tools/bus_tools/doctor.h"

namespace perdure::tools {
namespace {

struct DoctorOptions {
  bus::Options bus;
  double seconds = 2.5;
  std::vector<std::string> folders;
};

const char* wordOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "OK  ";
    case Verdict::kWarn:
      return "WARN";
    case Verdict::kFail:
      return "FAIL";
  }
  return "FAIL";
}

void runDoctor(const DoctorOptions& options) {
  Findings findings = checkHost(options.bus);
  for (const std::string& folder : options.folders) findings.push_back(checkWritable(folder));
  const Findings bus = checkBus(options.bus, options.seconds);
  findings.insert(findings.end(), bus.begin(), bus.end());
  for (const Finding& finding : findings) {
    std::cout << wordOf(finding.verdict) << " " << finding.text << '\n';
  }
  const bool failed = std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.verdict == Verdict::kFail;
  });
  if (failed) throw CLI::RuntimeError(1);
}

}  // namespace

void addDoctorCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "doctor", "check host, bus and services: a line each with OK, WARN or FAIL and the mend");
  auto options = std::make_shared<DoctorOptions>();
  command->add_option("--seconds", options->seconds, "how long to listen to the bus")
      ->capture_default_str();
  command->add_option("--data-dir", options->folders, "a folder that the services write to");
  addBusOptions(*command, options->bus);
  command->callback([options] { runDoctor(*options); });
}

}  // namespace perdure::tools
