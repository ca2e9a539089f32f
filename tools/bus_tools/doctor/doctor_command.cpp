#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "common/base/heap.h"
#include "tools/bus_tools/common.h"
#include "tools/bus_tools/doctor/doctor.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

struct DoctorOptions {
  bus::Options bus;
  double seconds = 2.5;
  std::vector<std::string> folders;
  std::string configuration = configurationFolder();
  std::string report;
  bool images = false;
  Drive drive;
  std::string copy, network;
  std::optional<double> rig_seconds;
};

const char* wordOf(Verdict verdict) { return nameAt(std::array{"OK  ", "WARN", "FAIL"}, verdict); }

void stopIfFailed(const Findings& findings, int status = 1) {
  const bool failed = std::ranges::any_of(
      findings, [](const Finding& finding) { return finding.verdict == Verdict::kFail; });
  if (failed) throw CLI::RuntimeError(status);
}

void runDoctor(const DoctorOptions& given) {
  if (!given.drive.poses.empty() && !given.copy.empty()) {
    throw StartupError(ExitCode::kUsage,
                       "--poses are not looked at beside --fix; give them in a second call, with "
                       "--data COPY");
  }
  if (!given.drive.data.empty()) {
    keepFreedMemory();
    std::fprintf(stderr, "checks %s\n", given.drive.data.c_str());  // large images take seconds
    Findings findings = given.copy.empty() ? checkRigBy(given.drive, given.rig_seconds)
                                           : fixRecording(given.drive, given.copy);
    const bool named = !given.network.empty();
    const auto network = named ? given.network : configuredNetwork(given.configuration);
    std::error_code error;
    if (named || std::filesystem::is_regular_file(network, error)) {
      // Uses the fixed copy if there is one, because a damaged recording may not open.
      const Drive drive = given.copy.empty() || !std::filesystem::is_directory(given.copy, error)
                              ? given.drive
                              : Drive{.data = given.copy, .rig = given.drive.rig};
      try {
        const Findings shape = checkNetworkShape(drive, network);
        findings.insert(findings.end(), shape.begin(), shape.end());
      } catch (const StartupError& e) {
        // The findings about the recording are reported in spite of this error.
        findings.push_back({named ? Verdict::kFail : Verdict::kWarn,
                            fmt::format("the network's shape was not looked at: {}", e.what())});
      }
    }
    std::cout << toText(findings);
    return stopIfFailed(findings, static_cast<int>(ExitCode::kData));
  }
  DoctorOptions options = given;
  options.bus.shared_memory_mb =
      std::max(options.bus.shared_memory_mb, configuredSharedMemory(options.configuration));
  Findings findings = checkHost(options.bus);
  const std::string roudi = options.configuration + "/roudi.toml";
  const Findings shared = checkSharedMemory(options.bus, roudi);
  findings.insert(findings.end(), shared.begin(), shared.end());
  options.bus.shared_memory_mb = 0;  // readers do not need shared memory
  const Findings security = checkSecurity(options.bus);
  findings.insert(findings.end(), security.begin(), security.end());
  for (const std::string& folder : options.folders) findings.push_back(checkWritable(folder));
  const Findings bus = checkBus(options.bus, options.seconds);
  findings.insert(findings.end(), bus.begin(), bus.end());
  std::cout << toText(findings);
  if (!options.report.empty()) {
    writeReport({.bus = options.bus,
                 .file = options.report,
                 .configuration = options.configuration,
                 .images = options.images},
                findings);
    std::cout << "report: " << options.report << '\n';
  }
  stopIfFailed(findings);
}

}  // namespace

std::string toText(const Findings& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += std::string(wordOf(finding.verdict)) + " " + finding.text + "\n";
  }
  return text;
}

void setUpDoctor(CLI::App& command) {
  auto options = std::make_shared<DoctorOptions>();
  // An unset shell variable must not select the default check.
  const CLI::Validator not_empty(
      [](const std::string& text) { return std::string(text.empty() ? "is empty" : ""); }, "");
  command.add_option("--seconds", options->seconds, "how long to listen to the bus")
      ->capture_default_str();
  command.add_option("--data-dir", options->folders, "a folder that the services write to");
  command
      .add_option("--config-dir", options->configuration,
                  "folder of the services' configuration: /etc/perdure, else config")
      ->capture_default_str();
  command.add_option("--shared-memory-mb", options->bus.shared_memory_mb,
                     "check RouDi as if bus.shared_memory_mb were this");
  command
      .add_option("--report", options->report,
                  "pack what a maintainer asks for: versions, host, configuration, status, "
                  "five seconds of Health, journal")
      ->type_name("FILE.tar.gz");
  command
      .add_option("--data", options->drive.data,
                  "judge a rig by this recording instead (dataset folder or .mcap with images): "
                  "vio runs over it, and its innovations tell")
      ->check(not_empty)
      ->type_name("DRIVE");
  command
      .add_option("--sequence", options->drive.sequence,
                  "of a KITTI tracking folder, for example 0000, or a 7-Scenes one, for example "
                  "seq-01")
      ->needs("--data")
      ->type_name("NAME");
  command
      .add_option("--rig", options->drive.rig,
                  "with --data: the rig file to judge, instead of the recording's own calibration")
      ->needs("--data");
  command
      .add_option("--poses", options->drive.poses,
                  "with --data: a file of another program's poses, as --odometry of perdure "
                  "pipeline takes it, compared with images and inertial samples")
      ->needs("--data")
      ->check(not_empty)
      ->type_name("FILE");
  command
      .add_option(
          "--fix", options->copy,
          "with --data: a new folder for a repaired copy (units, exchanged columns, inverted T_BS, "
          "order and stamps, the rig of --rig)")
      ->needs("--data")
      ->check(not_empty)
      ->type_name("FOLDER");
  command
      .add_option("--model", options->network,
                  "with --data: the network whose input is compared with the camera's shape; "
                  "model.path of inference.yaml where not given")
      ->type_name("FILE");
  command
      .add_option("--rig-seconds", options->rig_seconds,
                  "of the recording by which the rig is judged; until it is surely good, and 60 "
                  "at most, where not given")
      ->check(CLI::Range(5.0, 3600.0));
  command.add_flag("--images", options->images, "with an image of each camera in the report");
  addBusOptions(command, options->bus);
  command.callback([options] { runDoctor(*options); });
}

}  // namespace perdure::tools
