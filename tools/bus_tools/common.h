// What the subcommands share: the bus's options, and waiting with an end by time or by signal.
#pragma once

#include <functional>
#include <string>

#include "common/bus/wait_loop.h"
#include "tools/bus_tools/settings.h"

namespace CLI {
class App;
}

namespace perdure::tools {

/// --interface, --domain, --vehicle, --security, --identity; what they do not say is said by
/// bus.yaml, where the services' configuration is.
void addBusOptions(CLI::App& command, bus::Options& options);

/// Runs the loop until it is stopped, a signal comes, or the seconds (0 = for ever) are over.
void runLoop(bus::WaitLoop& loop, double seconds);

/// CLOCK_MONOTONIC.
double steadySeconds();

/// The five, as their Health and their participants call them.
inline constexpr const char* kUsualServices[] = {"capture", "vio", "inference", "semantic_filter",
                                                 "map_store"};

[[noreturn]] void refuseTopic(const std::string& topic);

}  // namespace perdure::tools
