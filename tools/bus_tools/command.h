// Subcommands for the bus: `perdure topics`, `hz`, `echo`, `env`, `doctor`, `status`.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addTopicsCommand(CLI::App& app);
void addHzCommand(CLI::App& app);
void addEchoCommand(CLI::App& app);
void addEnvCommand(CLI::App& app);
void addDoctorCommand(CLI::App& app);
void addStatusCommand(CLI::App& app);

/// Adds all of them.
void addBusCommands(CLI::App& app);

}  // namespace perdure::tools
