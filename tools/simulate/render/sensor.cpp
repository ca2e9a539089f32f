#include "tools/simulate/render/sensor.h"

#include <algorithm>
#include <cmath>

#include "tools/simulate/render/counter_noise.h"

namespace perdure::tools {
namespace {

constexpr double kMiddleGrey = 0.16;    ///< desired mean of the image, of full scale
constexpr double kAdaptation_s = 0.4;   ///< time constant of the exposure
constexpr double kGainReturn_s = 10.0;  ///< time constant of the gain's return
constexpr int kGammaSteps = 4096;
constexpr int kMeterStep = 8;
const Eigen::Vector3f kLuminance(0.2126F, 0.7152F, 0.0722F);

/// Gamma table, indexed by the square root of the linear value for high resolution in the steep
/// part of the curve. Light above 0.7 is compressed as in cameras, so that skies keep contrast.
std::vector<std::uint8_t> gammaTable() {
  std::vector<std::uint8_t> table;
  for (int i = 0; i < kGammaSteps; ++i) {
    const double root = (i + 0.5) / kGammaSteps * std::sqrt(2.0);
    double linear = root * root;
    if (linear > 0.7) linear = 0.7 + 0.3 * (1.0 - std::exp(-(linear - 0.7) / 0.3));
    table.push_back(static_cast<std::uint8_t>(std::lround(255.0 * std::pow(linear, 1.0 / 2.2))));
  }
  return table;
}

/// Mean logarithm of the luminance; very dark and bright pixels are clamped.
double metered(const Picture& picture) {
  double sum = 0.0;
  std::size_t count = 0;
  for (int row = kMeterStep / 2; row < picture.height; row += kMeterStep) {
    for (int column = kMeterStep / 2; column < picture.width; column += kMeterStep) {
      const float light = kLuminance.dot(picture.radiance[picture.index(column, row)].head<3>());
      sum += std::log(std::clamp(static_cast<double>(light), 0.01, 3.0));
      ++count;
    }
  }
  return count ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace

Sensor::Sensor(const SensorOptions& options, const Lens& lens)
    : options_(options), gamma_(gammaTable()) {
  const double cx = lens.width() / 2.0, cy = lens.height() / 2.0;
  for (int row = 0; row < lens.height(); ++row) {
    for (int column = 0; column < lens.width(); ++column) {
      const double x = (column - cx) / cx, y = (row - cy) / cy;
      const double r2 = (x * x * cx * cx + y * y * cy * cy) / (cx * cx + cy * cy);
      fading_.push_back(static_cast<float>(1.0 - options.errors.vignetting * r2));
    }
  }
}

void Sensor::expose(const Picture& picture, std::uint64_t index) {
  const double wanted = std::log(kMiddleGrey) - metered(picture);
  // Each image determines the exposure of the next one; the first uses its own metering.
  if (state_.frames == 0 || !options_.adapt) state_.log_exposure = wanted;
  scale_ = static_cast<float>(std::exp(state_.log_exposure + state_.log_gain));
  const double share = 1.0 - std::exp(-options_.interval_s / kAdaptation_s);
  state_.log_exposure += share * (wanted - state_.log_exposure);
  ++state_.frames;
  if (!options_.noise) return;
  const double step = options_.errors.gain_walk * std::sqrt(options_.interval_s);
  const std::uint64_t bits = mixBits(mixBits(options_.seed, 0x6a17), index);
  state_.log_gain *= std::exp(-options_.interval_s / kGainReturn_s);
  state_.log_gain += step * static_cast<double>(normalOf(bits));
}

std::vector<std::uint8_t> Sensor::develop(const Picture& picture, std::uint64_t index,
                                          Workers& workers) {
  expose(picture, index);
  std::vector<std::uint8_t> image(picture.radiance.size() * channelsOf(options_.encoding));
  const std::uint64_t noise_seed = mixBits(mixBits(options_.seed, 0x2015e), index);
  workers.run(static_cast<std::size_t>(picture.height), [&](std::size_t row) {
    developRow(picture, static_cast<int>(row), noise_seed, image);
  });
  return image;
}

std::uint8_t Sensor::digitise(float value, std::uint64_t noise_bits) const {
  if (options_.noise) {
    const auto well = static_cast<float>(options_.errors.full_well_electrons);
    const auto read = static_cast<float>(options_.errors.noise_electrons);
    const float electrons = value * well;
    value += std::sqrt(electrons + read * read) / well * normalOf(mixBits(noise_bits));
  }
  const float root = std::sqrt(std::clamp(value, 0.0F, 1.999F) * 0.5F);
  return gamma_[static_cast<std::size_t>(root * kGammaSteps)];
}

void Sensor::developRow(const Picture& picture, int row, std::uint64_t noise_seed,
                        std::vector<std::uint8_t>& image) const {
  const std::size_t channels = channelsOf(options_.encoding);
  for (int column = 0; column < picture.width; ++column) {
    const std::size_t at = picture.index(column, row);
    const Eigen::Vector3f light = picture.radiance[at].head<3>() * (scale_ * fading_[at]);
    std::uint8_t* out = &image[at * channels];
    const std::uint64_t bits = noise_seed + 4 * at;
    if (channels == 1) {
      out[0] = digitise(light.dot(kLuminance), bits);
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      out[c] = digitise(light[2 - c], bits + static_cast<std::uint64_t>(c));
    }
  }
}

}  // namespace perdure::tools
