// The checks of `perdure doctor`: each is a line with its verdict and, where it fails, the mend.
#pragma once

#include <string>
#include <vector>

#include "common/bus/domain.h"

namespace perdure::tools {

enum class Verdict { kOk, kWarn, kFail };

struct Finding {
  Verdict verdict = Verdict::kOk;
  std::string text;  ///< what was found; the mend where it is not well
};
using Findings = std::vector<Finding>;

/// Of the host: receive buffers, the interface, large datagrams over loopback, the clock.
Findings checkHost(const bus::Options& options);
/// Of a folder that a service must write to.
Finding checkWritable(const std::string& folder);
/// Of the bus: who is there, what each says of itself, what does not fit together.
Findings checkBus(const bus::Options& options, double seconds);

}  // namespace perdure::tools
