// The file that says where a run is (run.state), written whole or not at all.
#pragma once

#include <optional>
#include <string>

#include "services/capture/config.h"
#include "services/capture/core/run_state.h"

namespace perdure::capture {

/// Identity of a run: drive, pace and rate, so that another one is not taken for it.
std::string driveOf(const Config& config);
/// Changes with each start of the machine.
std::string bootId();

/// The state of the same run on the same boot; nothing where there is none, or where `config`
/// names no file.
std::optional<RunState> readRunState(const Config& config);

/// Replaces the file. False where it cannot be written.
bool writeRunState(const std::string& file, const RunState& state);

}  // namespace perdure::capture
