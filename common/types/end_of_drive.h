// A recorded drive that has ended is no fault of the services that wait for more of it.
#pragma once

#include "common/types/health.h"

namespace perdure {

/// Message in the Health of capture.
inline constexpr char kEndOfDrive[] = "end of drive";
/// A reason in Health, set if the silence of inputs is the only cause of the degraded state.
inline constexpr char kInputSilent[] = "input_silent";

/// Returns whether the end of the drive is the only fault. `capture` is null if none was received.
inline bool endedWith(const Health* capture, const Health& health) {
  return capture != nullptr && capture->message == kEndOfDrive &&
         health.state == HealthState::kDegraded && health.reasons.contains(kInputSilent);
}

}  // namespace perdure
