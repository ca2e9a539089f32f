#include "tools/evaluate/command.h"

#include <CLI/CLI.hpp>

namespace perdure::tools {

void setUpEvaluate(CLI::App& evaluate) {
  evaluate.require_subcommand(1);
  addEvaluateObjects(evaluate);
  addEvaluateTrajectory(evaluate);
  addEvaluateConsistency(evaluate);
  addEvaluateMemory(evaluate);
}

}  // namespace perdure::tools
