// `perdure demo`: the five services under supervision over a drive, and a report of what came out.
// deploy/demo installs and builds, then calls it.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addDemoCommand(CLI::App& app);

}  // namespace perdure::tools
