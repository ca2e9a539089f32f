#include "services/capture/live/libcamera_controls.h"

#include <fmt/format.h>
#include <libcamera/control_ids.h>

#include <array>
#include <cmath>

namespace perdure::capture {
namespace {

namespace controls = libcamera::controls;

class Asking {
 public:
  explicit Asking(const libcamera::ControlInfoMap& offered) : offered_(offered) {}

  template <class T>
  bool offers(const libcamera::Control<T>& control) const {
    return offered_.find(control.id()) != offered_.end();
  }
  /// `key`: what in the configuration goes without it.
  template <class T, class V>
  void set(const libcamera::Control<T>& control, const V& value, const char* key) {
    if (offers(control)) return list_.set(control, value);
    missing_ += fmt::format("{}{} ({})", missing_.empty() ? "" : ", ", control.name(), key);
  }
  AskedControls asked() && {
    if (!missing_.empty()) {
      missing_ = fmt::format("The camera offers no {}, and keeps its own.", missing_);
    }
    return {std::move(list_), std::move(missing_)};
  }
  libcamera::ControlList& list() { return list_; }

 private:
  const libcamera::ControlInfoMap& offered_;
  libcamera::ControlList list_{controls::controls};
  std::string missing_;
};

}  // namespace

AskedControls controlsFor(const CameraSettings& settings,
                          const libcamera::ControlInfoMap& offered) {
  Asking asking(offered);
  if (asking.offers(controls::FrameDurationLimits)) {
    const std::int64_t us = std::llround(1e6 / settings.rate_hz);
    const std::array<std::int64_t, 2> limits = {us, us};
    asking.list().set(controls::FrameDurationLimits,
                      libcamera::Span<const std::int64_t, 2>(limits));
  }
  if (settings.exposure_ms > 0.0) {
    asking.set(controls::AeEnable, false, "camera.exposure_ms");
    asking.set(controls::ExposureTime, static_cast<std::int32_t>(1e3 * settings.exposure_ms),
               "camera.exposure_ms");
  }
  if (settings.gain > 0.0) {
    asking.set(controls::AnalogueGain, static_cast<float>(settings.gain), "camera.gain");
  }
  if (settings.crop.size() == 4) {
    const auto& c = settings.crop;
    asking.set(controls::ScalerCrop,
               libcamera::Rectangle(static_cast<int>(c[0]), static_cast<int>(c[1]),
                                    static_cast<unsigned>(c[2]), static_cast<unsigned>(c[3])),
               "camera.crop");
  }
  return std::move(asking).asked();
}

}  // namespace perdure::capture
