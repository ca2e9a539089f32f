#include "tools/bus_tools/command.h"

namespace perdure::tools {

void addBusCommands(CLI::App& app) {
  addTopicsCommand(app);
  addHzCommand(app);
  addEchoCommand(app);
  addEnvCommand(app);
  addDoctorCommand(app);
  addStatusCommand(app);
}

}  // namespace perdure::tools
