// `perdure pipeline`: runs the services' nodes in one process on a dataset folder.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addPipelineCommand(CLI::App& app);

}  // namespace perdure::tools
