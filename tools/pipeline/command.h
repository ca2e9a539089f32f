// `perdure pipeline`: the services' nodes in one process, over a dataset folder.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addPipelineCommand(CLI::App& app);

}  // namespace perdure::tools
