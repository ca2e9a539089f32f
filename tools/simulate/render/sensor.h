// A camera's sensor: what becomes of radiance on the way to eight bits. Automatic exposure, fading
// towards the corners, shot and read noise, a gain that wanders, gamma and quantisation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/sim/scene.h"
#include "tools/simulate/render/lens.h"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/render/workers.h"

namespace perdure::tools {

/// What a sensor carries from one image to the next.
struct SensorState {
  std::uint64_t frames = 0;   ///< taken so far
  double log_exposure = 0.0;  ///< of what brings the scene to the wanted brightness
  double log_gain = 0.0;      ///< the wandering error of the gain
};

struct SensorOptions {
  sim::CameraErrors errors;
  ImageEncoding encoding = ImageEncoding::kBgr8;
  bool noise = true;  ///< shot and read noise and the wandering gain
  bool adapt = true;  ///< false: each image is exposed for itself, as single views are
  double interval_s = 0.05;
  std::uint64_t seed = 0;  ///< differs between cameras
};

class Sensor {
 public:
  Sensor(const SensorOptions& options, const Lens& lens);

  /// The image as packed rows, `index` being the frame's; noise depends on seed, index and pixel.
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
  std::vector<float> fading_;  ///< by pixel
  std::vector<std::uint8_t> gamma_;
  float scale_ = 1.0F;
};

}  // namespace perdure::tools
