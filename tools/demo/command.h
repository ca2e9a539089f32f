// `perdure demo`: runs the five services under supervision over a drive and reports the results.
// deploy/demo installs, builds and then calls it.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addDemoCommand(CLI::App& app);

}  // namespace perdure::tools
