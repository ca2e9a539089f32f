// Films of a few frames with telemetry as GoPro cameras write it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace perdure::replay {

/// An item of GPMF: key, type, bytes of a sample, number of samples, data; padded to four bytes.
std::string gpmfItem(const std::string& key, char type, std::size_t size, std::size_t count,
                     const std::string& data);
/// An item of numbers of 16, 32 or 64 bits, in samples of N numbers.
std::string gpmfNumbers(const std::string& key, char type, const std::vector<std::int64_t>& numbers,
                        std::size_t n = 1);

struct TinyGoPro {
  bool stamps = true;               ///< with STMP
  std::int64_t accel_late_us = 0;   ///< of the accelerometer's STMP
  std::vector<int> jitter_ms = {};  ///< of the times of the packets in the film
  std::size_t lost = 99;            ///< number of a packet that is missing
  std::size_t damaged = 99;         ///< number of a packet that is cut off
  std::int64_t image_turn = 0;      ///< last images' turn: the z of a quaternion, 32767 is 1
};
/// Writes a film of 40 frames at 20 Hz with the telemetry of 2 s, in four packets: gyroscope at
/// 200 Hz, which counts its samples about x in mrad/s, and accelerometer at 100 Hz.
void writeGoPro(const std::filesystem::path& film, const TinyGoPro& how = {});

}  // namespace perdure::replay
