// Reads and atomically writes the file of the run state (run.state).
#pragma once

#include <optional>
#include <string>

#include "services/capture/config.h"
#include "services/capture/core/run_state.h"

namespace perdure::capture {

std::string driveOf(const Config& config);
/// Returns the identity of the machine's current boot.
std::string bootId();

/// Returns the stored state of the same run on the same boot. Returns nothing if there is none, or
/// if `config` names no file.
std::optional<RunState> readRunState(const Config& config);

/// Replaces the file. Returns false if the file cannot be written.
bool writeRunState(const std::string& file, const RunState& state);

}  // namespace perdure::capture
