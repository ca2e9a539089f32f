#include "tools/evaluate/command.h"

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addEvaluateCommand(CLI::App& app) {
  CLI::App* evaluate = app.add_subcommand("evaluate", "Compare results with truth");
  evaluate->require_subcommand(1);
  addEvaluateObjects(*evaluate);
  addEvaluateTrajectory(*evaluate);
  addEvaluateConsistency(*evaluate);
  addEvaluateMemory(*evaluate);
}

}  // namespace perdure::tools
