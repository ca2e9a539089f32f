// `perdure security`: identities for a bus that is closed to strangers.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addSecurityCommand(CLI::App& app);

}  // namespace perdure::tools
