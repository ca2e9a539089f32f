// `perdure map`: queries the map store over DDS, or reads its file.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addMapCommand(CLI::App& app);

}  // namespace perdure::tools
