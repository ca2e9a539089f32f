// Checks whether the readings of an IMU become samples. With wrong stamps, data arrive but give no
// samples.
#pragma once

#include <cstdint>
#include <string>

namespace perdure::capture {

class ImuYield {
 public:
  /// Takes the current totals of readings and of samples made from them. Returns a sentence if
  /// fewer than half of the readings since the last call became samples; otherwise empty.
  std::string look(std::uint64_t read, std::uint64_t given);

 private:
  std::uint64_t read_ = 0, given_ = 0;
};

}  // namespace perdure::capture
