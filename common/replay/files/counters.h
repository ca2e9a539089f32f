// The known counters from which sensors take their stamps, and that start again at 0.
#pragma once

#include <string>
#include <vector>

#include "common/base/time.h"

namespace perdure::replay {

struct Counter {
  Duration length;
  std::string name;        ///< "32 bits of µs"
  bool of_cycles = false;  ///< counts a processor's cycles; such lengths lie close together
};

const std::vector<Counter>& knownCounters();

}  // namespace perdure::replay
