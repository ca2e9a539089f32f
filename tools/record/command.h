// `perdure record` (with info, repair, export) and `perdure play`.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addRecordCommand(CLI::App& app);
void addPlayCommand(CLI::App& app);

}  // namespace perdure::tools
