// `perdure security`: identities for a bus with access control.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addSecurityCommand(CLI::App& app);

}  // namespace perdure::tools
