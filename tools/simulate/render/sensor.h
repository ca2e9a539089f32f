// Simulates a camera's sensor, which converts radiance to eight bits: automatic exposure,
// vignetting, shot and read noise, random-walk gain, gamma and quantisation.
#pragma once

#include <cstdint>
#include <vector>

#include "common/sim/scene.h"
#include "tools/simulate/render/lens.h"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/render/workers.h"

namespace perdure::tools {

struct SensorState {
  std::uint64_t frames = 0;   ///< number of images so far
  double log_exposure = 0.0;  ///< logarithm of the factor to the desired brightness
  double log_gain = 0.0;      ///< random-walk error of the gain
};

struct SensorOptions {
  sim::CameraErrors errors;
  ImageEncoding encoding = ImageEncoding::kBgr8;
  bool noise = true;  ///< includes shot noise, read noise and random-walk gain
  bool adapt = true;  ///< false: exposes each image separately, for independent views
  double interval_s = 0.05;
  std::uint64_t seed = 0;  ///< seed, different for each camera
};

class Sensor {
 public:
  Sensor(const SensorOptions& options, const Lens& lens);

  /// The image as packed rows. `index`: frame index; the noise depends on seed, index and pixel.
  std::vector<std::uint8_t> develop(const Picture& picture, std::uint64_t index, Workers& workers);
  const SensorState& state() const { return state_; }
  void setState(const SensorState& state) { state_ = state; }

 private:
  void expose(const Picture& picture, std::uint64_t index);
  void developRow(const Picture& picture, int row, std::uint64_t noise_seed,
                  std::vector<std::uint8_t>& image) const;
  std::uint8_t digitise(float value, std::uint64_t noise_bits) const;

  SensorOptions options_;
  SensorState state_;
  std::vector<float> fading_;  ///< factor for each pixel
  std::vector<std::uint8_t> gamma_;
  float scale_ = 1.0F;
};

}  // namespace perdure::tools
