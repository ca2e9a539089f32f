// The subcommands of `perdure`. Each is an executable in libexec/perdure (perdure_command in
// CMake).
#pragma once

#include <filesystem>
#include <span>

namespace CLI {
class App;
}

namespace perdure::tools {

struct CommandEntry {
  const char* name;
  const char* summary;
};

/// All subcommands in the order of `perdure --help`.
std::span<const CommandEntry> commands();

/// Each function adds the options of its subcommand, and nested subcommands.
void setUpCalibrate(CLI::App& command);
void setUpDemo(CLI::App& command);
void setUpDetect(CLI::App& command);
void setUpDoctor(CLI::App& command);
void setUpEcho(CLI::App& command);
void setUpEnv(CLI::App& command);
void setUpEvaluate(CLI::App& command);
void setUpHz(CLI::App& command);
void setUpInference(CLI::App& command);
void setUpMap(CLI::App& command);
void setUpMcp(CLI::App& command);
void setUpModel(CLI::App& command);
void setUpPipeline(CLI::App& command);
void setUpPlay(CLI::App& command);
void setUpRecord(CLI::App& command);
void setUpSecurity(CLI::App& command);
void setUpSimulate(CLI::App& command);
void setUpStatus(CLI::App& command);
void setUpTopics(CLI::App& command);

/// Runs a subcommand; called by the main function of its executable. Returns the exit status.
int runCommand(const char* name, void (*set_up)(CLI::App&), int argc, char** argv);

/// Returns the folder with `perdure` and the services. For use in a subcommand's executable.
std::filesystem::path programFolder();

}  // namespace perdure::tools
