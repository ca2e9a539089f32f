// `perdure inference swap`: replaces the network without interrupting the frames.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addInferenceCommand(CLI::App& app);

}  // namespace perdure::tools
