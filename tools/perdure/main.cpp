// The `perdure` command. Each subcommand is one line here; its code is in its own folder of tools/.
#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <string>

#include "common/base/errors.h"
#include "tools/bus_tools/command.h"
#include "tools/calibrate/command.h"
#include "tools/demo/command.h"
#include "tools/detect/command.h"
#include "tools/evaluate/command.h"
#include "tools/inference/command.h"
#include "tools/map/command.h"
#include "tools/model/command.h"
#include "tools/pipeline/command.h"
#include "tools/record/command.h"
#include "tools/security/command.h"
#include "tools/simulate/command.h"

namespace {

/// Checks that all output was written. A full disk or a closed file is an error.
int checkedOutput(int status) {
  errno = 0;
  std::cout.flush();
  const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
  if (written || status != static_cast<int>(perdure::ExitCode::kOk)) return status;
  std::cerr << "perdure: standard output could not be written whole"
            << (errno != 0 ? std::string(" (") + std::strerror(errno) + ")" : std::string())
            << "; free space, or send it elsewhere" << std::endl;
  return static_cast<int>(perdure::ExitCode::kInputOutput);
}

int run(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& error) {
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = app.exit(error) == 0;
    return static_cast<int>(asked_for_help ? perdure::ExitCode::kOk : perdure::ExitCode::kUsage);
  } catch (const perdure::StartupError& error) {
    std::cerr << "perdure: " << error.what() << std::endl;
    return static_cast<int>(error.code());
  } catch (const std::exception& error) {
    std::cerr << "perdure: " << error.what() << std::endl;
    return static_cast<int>(perdure::ExitCode::kFailure);
  }
  return static_cast<int>(perdure::ExitCode::kOk);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Perdure: a persistent, metric map of objects from a camera and an IMU");
  app.set_version_flag("--version", PERDURE_VERSION);
  app.require_subcommand(1);
  perdure::tools::addPipelineCommand(app);
  perdure::tools::addEvaluateCommand(app);
  perdure::tools::addDetectCommand(app);
  perdure::tools::addModelCommand(app);
  perdure::tools::addInferenceCommand(app);
  perdure::tools::addSimulateCommand(app);
  perdure::tools::addCalibrateCommand(app);
  perdure::tools::addMapCommand(app);
  perdure::tools::addDemoCommand(app);
  perdure::tools::addRecordCommand(app);
  perdure::tools::addPlayCommand(app);
  perdure::tools::addSecurityCommand(app);
  perdure::tools::addBusCommands(app);
  return checkedOutput(run(app, argc, argv));
}
