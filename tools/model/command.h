// `perdure model`: imports a user's network and shows its detections.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addFetch(CLI::App& model);
void addCalibrate(CLI::App& model);

}  // namespace perdure::tools
