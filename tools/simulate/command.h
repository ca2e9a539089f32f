// `perdure simulate`: a rendered camera and IMU sequence with exact truth.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addSimulateCommand(CLI::App& app);

}  // namespace perdure::tools
