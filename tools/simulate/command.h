// `perdure simulate`: renders a camera and IMU sequence with exact ground truth.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addSimulateCommand(CLI::App& app);

}  // namespace perdure::tools
