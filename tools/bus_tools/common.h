// Functions that the subcommands share: bus options, and a loop that ends after a time or a signal.
#pragma once

#include <string>

#include "common/bus/wait_loop.h"
#include "tools/bus_tools/settings.h"

namespace CLI {
class App;
}

namespace perdure::tools {

/// Adds --interface, --peers, --domain, --vehicle, --security and --identity. The defaults come
/// from bus.yaml in the services' configuration folder.
void addBusOptions(CLI::App& command, bus::Options& options);

/// Runs the loop until it is stopped, a signal arrives, or `seconds` have passed (0: no limit).
void runLoop(bus::WaitLoop& loop, double seconds);

double steadySeconds();

/// The five services, by their names in Health and in discovery.
inline constexpr const char* kUsualServices[] = {"capture", "vio", "inference", "semantic_filter",
                                                 "map_store"};

[[noreturn]] void refuseTopic(const std::string& topic);

}  // namespace perdure::tools
