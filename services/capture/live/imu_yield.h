// Whether what an IMU says becomes samples: where its stamps are wrong it flows, and gives nothing.
#pragma once

#include <cstdint>
#include <string>

namespace perdure::capture {

class ImuYield {
 public:
  /// Totals of readings and of samples made of them, as they stand now. A sentence where fewer than
  /// half of the readings since the last look became samples; else empty.
  std::string look(std::uint64_t read, std::uint64_t given);

 private:
  std::uint64_t read_ = 0, given_ = 0;
};

}  // namespace perdure::capture
