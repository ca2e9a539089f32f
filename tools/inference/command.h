// `perdure inference swap`: another network takes over while frames go on.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addInferenceCommand(CLI::App& app);

}  // namespace perdure::tools
