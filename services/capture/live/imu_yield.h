// Detects wrong stamps of an IMU: data arrive but give no samples.
#pragma once

#include <cstdint>
#include <string>

namespace perdure::capture {

class ImuYield {
 public:
  /// Takes totals of readings and samples. A sentence if fewer than half became samples.
  std::string look(std::uint64_t read, std::uint64_t given);

 private:
  std::uint64_t read_ = 0, given_ = 0;
};

}  // namespace perdure::capture
