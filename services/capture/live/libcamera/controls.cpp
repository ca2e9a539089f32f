#include "services/capture/live/libcamera/controls.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libcamera/control_ids.h>
#include <libcamera/formats.h>
#include <libcamera/transform.h>
#include <libcamera/version.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace perdure::capture {
namespace {

namespace controls = libcamera::controls;
namespace formats = libcamera::formats;

/// Formats in order of preference: least conversion and full colour first. libcamera names the
/// bytes of a pixel from the last one in memory to the first.
const std::array<KnownFormat, 11> kFormats = {{
    {formats::RGB888, PixelLayout::kBgr},
    {formats::BGR888, PixelLayout::kRgb},
    {formats::XRGB8888, PixelLayout::kBgrx},
    {formats::XBGR8888, PixelLayout::kRgbx},
    {formats::NV12, PixelLayout::kNv12},
    {formats::NV21, PixelLayout::kNv21},
    {formats::YUV420, PixelLayout::kYuv420},
    {formats::YUYV, PixelLayout::kYuyv},
    {formats::UYVY, PixelLayout::kUyvy},
    {formats::MJPEG, PixelLayout::kJpeg},
    {formats::R8, PixelLayout::kGrey},
}};

class Asking {
 public:
  explicit Asking(const libcamera::ControlInfoMap& offered) : offered_(offered) {}

  template <class T>
  bool offers(const libcamera::Control<T>& control) const {
    return offered_.find(control.id()) != offered_.end();
  }
  /// Requests a control. If the camera lacks it, `key`, the setting that then has no effect, is
  /// reported.
  template <class T, class V>
  void set(const libcamera::Control<T>& control, const V& value, const char* key) {
    if (offers(control)) return list_.set(control, value);
    missing_ += fmt::format("{}{} ({})", missing_.empty() ? "" : ", ", control.name(), key);
  }
  AskedControls asked() && {
    if (!missing_.empty()) {
      missing_ = fmt::format("The camera offers no {}, and keeps its own.", missing_);
    }
    return {std::move(list_), std::move(missing_), std::move(refused_)};
  }
  libcamera::ControlList& list() { return list_; }
  const libcamera::ControlInfo& limits(const libcamera::ControlId& control) const {
    return offered_.at(control.id());
  }
  void refuse(std::string why) { refused_ = std::move(why); }

 private:
  const libcamera::ControlInfoMap& offered_;
  libcamera::ControlList list_{controls::controls};
  std::string missing_, refused_;
};

// From libcamera 0.5 on, exposure time and gain each have their own automatic mode, which ignores
// the manual value. A camera without automatic gain then has no AeEnable.
#if LIBCAMERA_VERSION_MAJOR > 0 || LIBCAMERA_VERSION_MINOR >= 5
void askManualExposure(Asking& asking) {
  if (!asking.offers(controls::ExposureTimeMode)) {
    return asking.set(controls::AeEnable, false, "camera.exposure_ms");
  }
  asking.list().set(controls::ExposureTimeMode,
                    static_cast<std::int32_t>(controls::ExposureTimeModeManual));
}
void askManualGain(Asking& asking) {
  if (!asking.offers(controls::AnalogueGainMode)) return;
  asking.list().set(controls::AnalogueGainMode,
                    static_cast<std::int32_t>(controls::AnalogueGainModeManual));
}
#else
void askManualExposure(Asking& asking) {
  asking.set(controls::AeEnable, false, "camera.exposure_ms");
}
void askManualGain(Asking&) {}
#endif

/// Requests the focus. A camera without focus control is refused, because its focus could differ
/// from the rig's calibration unnoticed.
void askFocus(const CameraSettings& settings, Asking& asking) {
  const bool manual = settings.focus == "manual";
  if (settings.focus == "as_is") return;
  if (!asking.offers(controls::AfMode) || (manual && !asking.offers(controls::LensPosition))) {
    return asking.refuse("has no focus to set; set camera.focus to as_is.");
  }
  const auto mode = manual ? controls::AfModeManual : controls::AfModeContinuous;
  asking.list().set(controls::AfMode, static_cast<std::int32_t>(mode));
  if (!manual) return;
  const auto& limits = asking.limits(controls::LensPosition);
  const float least = limits.min().get<float>(), most = limits.max().get<float>();
  const auto place = static_cast<float>(settings.lens_dioptres);
  if (place < least || place > most) {
    return asking.refuse(
        fmt::format("focuses from {:g} to {:g} dioptres; set camera.lens_dioptres to one of these.",
                    least, most));
  }
  asking.list().set(controls::LensPosition, place);
}

libcamera::Transform transformOf(const std::string& flip) {
  if (flip == "horizontal") return libcamera::Transform::HFlip;
  if (flip == "vertical") return libcamera::Transform::VFlip;
  return flip == "both" ? libcamera::Transform::HVFlip : libcamera::Transform::Identity;
}

// Before libcamera 0.2, the configuration has the transform of the upright image; since then, it
// has the resulting orientation.
#if __has_include(<libcamera/orientation.h>)
libcamera::Orientation orientationOf(const std::string& flip) {
  return libcamera::Orientation::Rotate0 * transformOf(flip);
}
auto& orientationIn(auto& configuration) { return configuration.orientation; }
#else
libcamera::Transform orientationOf(const std::string& flip) { return transformOf(flip); }
auto& orientationIn(auto& configuration) { return configuration.transform; }
#endif

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
    askManualExposure(asking);
    asking.set(controls::ExposureTime, static_cast<std::int32_t>(1e3 * settings.exposure_ms),
               "camera.exposure_ms");
  }
  if (settings.gain > 0.0) {
    askManualGain(asking);
    asking.set(controls::AnalogueGain, static_cast<float>(settings.gain), "camera.gain");
  }
  if (settings.crop.size() == 4) {
    const auto& c = settings.crop;
    asking.set(controls::ScalerCrop,
               libcamera::Rectangle(static_cast<int>(c[0]), static_cast<int>(c[1]),
                                    static_cast<unsigned>(c[2]), static_cast<unsigned>(c[3])),
               "camera.crop");
  }
  askFocus(settings, asking);
  return std::move(asking).asked();
}

std::span<const KnownFormat> knownFormats() { return kFormats; }

void askFlip(libcamera::CameraConfiguration& configuration, const std::string& flip) {
  orientationIn(configuration) = orientationOf(flip);
}

bool flips(const libcamera::CameraConfiguration& configuration, const std::string& flip) {
  return orientationIn(configuration) == orientationOf(flip);
}

std::string flipRefused(const libcamera::CameraConfiguration& configuration,
                        const std::string& flip) {
  if (flip == "none" || flips(configuration, flip)) return "";
  return "cannot mirror its images as it is mounted; set camera.flip to none, and calibrate it so.";
}

Result<std::size_t> chooseCamera(const std::vector<std::string>& ids, const std::string& wanted,
                                 bool alone) {
  const auto place = [&](auto found) { return static_cast<std::size_t>(found - ids.begin()); };
  const auto exact = std::ranges::find(ids, wanted);
  if (exact != ids.end()) return place(exact);
  const auto has = [&](const std::string& id) { return id.find(wanted) != std::string::npos; };
  const auto first = std::ranges::find_if(ids, has);
  const auto n = std::ranges::count_if(ids, has);
  if (n == 0) {
    return fail("camera_absent",
                fmt::format("libcamera sees no camera{} (there are: {}); is it plugged in, and may "
                            "this user read /dev/video* and /dev/media*?",
                            wanted.empty() ? "" : " with " + wanted + " in its id",
                            ids.empty() ? "none" : fmt::format("{}", fmt::join(ids, ", "))));
  }
  if (alone && n > 1) {
    return fail("camera_absent",
                fmt::format("{} cameras have {} in their ids ({}), and which of them is left may "
                            "not change; set camera.id and camera.second to whole ids.",
                            n, wanted, fmt::join(ids, ", ")));
  }
  return place(first);
}

}  // namespace perdure::capture
