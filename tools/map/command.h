// `perdure map`: what the map store holds, asked over DDS or read from its file.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addMapCommand(CLI::App& app);

}  // namespace perdure::tools
