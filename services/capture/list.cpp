#include "services/capture/list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <iio.h>
#include <libcamera/control_ids.h>
#include <libcamera/libcamera.h>
#include <libcamera/property_ids.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "common/base/errors.h"
#include "services/capture/live/iio_stream.h"
#include "services/capture/live/libcamera/log.h"

namespace perdure::capture {
namespace {

constexpr std::size_t kMostSizes = 12;  // largest number of listed sizes of a mode

void addControls(const libcamera::ControlInfoMap& offered, SeenCamera& camera) {
  const auto has = [&](const auto& control) { return offered.find(control.id()) != offered.end(); };
  namespace controls = libcamera::controls;
  const std::pair<bool, const char*> keys[] = {
      {has(controls::FrameDurationLimits), "camera.rate_hz"},
      {has(controls::ExposureTime), "camera.exposure_ms"},
      {has(controls::AnalogueGain), "camera.gain"},
      {has(controls::AfMode), "camera.focus"},
      {has(controls::ScalerCrop), "camera.crop"}};
  for (const auto& [there, key] : keys) {
    if (there) camera.settable.emplace_back(key);
  }
  const auto limits = offered.find(controls::FrameDurationLimits.id());
  if (limits == offered.end()) return;
  const auto us = [](const libcamera::ControlValue& value) {
    return value.isNone() || value.isArray() ? 0 : value.get<std::int64_t>();
  };
  const auto shortest = us(limits->second.min()), longest = us(limits->second.max());
  if (shortest > 0) camera.fastest_hz = 1e6 / static_cast<double>(shortest);
  if (longest > 0) camera.slowest_hz = 1e6 / static_cast<double>(longest);
}

SeenCamera seenOf(libcamera::Camera& camera) {
  SeenCamera seen;
  seen.id = camera.id();
  seen.model = camera.properties().get(libcamera::properties::Model).value_or("");
  addControls(camera.controls(), seen);
  const auto configuration = camera.generateConfiguration({libcamera::StreamRole::Viewfinder});
  if (!configuration || configuration->empty()) return seen;
  const libcamera::StreamFormats& formats = configuration->at(0).formats();
  for (const auto& format : formats.pixelformats()) {
    SeenCamera::Mode mode{format.toString(), {}};
    for (const auto& size : formats.sizes(format)) mode.sizes.emplace_back(size.width, size.height);
    std::ranges::sort(mode.sizes);
    seen.modes.push_back(std::move(mode));
  }
  return seen;
}

void lookForCameras(Seen& seen) {
  std::vector<std::string> lines;
  const LibcameraLog log([&](const std::string& line) { lines.push_back(line); });
  libcamera::CameraManager manager;
  if (const int code = manager.start(); code < 0) {
    seen.problems.push_back(fmt::format("libcamera does not start: {}", std::strerror(-code)));
    return;
  }
  for (const auto& camera : manager.cameras()) seen.cameras.push_back(seenOf(*camera));
  manager.stop();
  seen.problems.insert(seen.problems.end(), lines.begin(), lines.end());
}

bool hasChannels(const iio_device* device, const char* kind) {
  for (const char* axis : {"x", "y", "z"}) {
    if (!iio_device_find_channel(device, fmt::format("{}_{}", kind, axis).c_str(), false)) {
      return false;
    }
  }
  return true;
}

/// Returns an attribute of the device, or of the first of its channels that has the attribute.
std::string attributeOf(const iio_device* device, const char* name) {
  char text[1024] = {};
  if (iio_device_attr_read(device, name, text, sizeof text) > 0) return trimmed(text);
  for (const char* channel : {"anglvel_x", "accel_x"}) {
    const iio_channel* found = iio_device_find_channel(device, channel, false);
    if (found && iio_channel_attr_read(found, name, text, sizeof text) > 0) return trimmed(text);
  }
  return {};
}

void lookForImus(const std::string& uri, Seen& seen) {
  const std::string given(uri.c_str());  // libiio 0.24 writes into a URI with a port
  const std::unique_ptr<iio_context, decltype(&iio_context_destroy)> context(
      iio_create_context_from_uri(given.c_str()), &iio_context_destroy);
  if (!context) {
    const int code = errno;
    const bool none = uri == "local:" && (code == ENOENT || code == ENOSYS);
    const std::string why = none ? "the kernel has no Industrial I/O devices (/sys/bus/iio/devices)"
                                 : fmt::format("{} does not answer: {}", uri, std::strerror(code));
    seen.problems.push_back(why + "; an IMU behind an iiod is looked for by --list ip:HOST");
    return;
  }
  std::vector<std::string> triggers;
  std::vector<SeenImu> found;
  for (unsigned i = 0; i < iio_context_get_devices_count(context.get()); ++i) {
    const iio_device* device = iio_context_get_device(context.get(), i);
    const char* name = iio_device_get_name(device);
    const std::string id = iio_device_get_id(device);
    if (id.starts_with("trigger")) {
      triggers.emplace_back(name ? name : id.c_str());
      continue;
    }
    SeenImu imu{id,
                name ? name : "",
                hasChannels(device, "anglvel"),
                hasChannels(device, "accel"),
                attributeOf(device, "sampling_frequency_available"),
                0.0,
                {}};
    if (!imu.gyro && !imu.accel) continue;
    imu.rate_hz = std::strtod(attributeOf(device, "sampling_frequency").c_str(), nullptr);
    found.push_back(std::move(imu));
  }
  for (SeenImu& imu : found) {
    imu.triggers = triggers;
    seen.imus.push_back(std::move(imu));
  }
}

std::string textOf(const SeenCamera& camera) {
  std::string text = fmt::format("camera    {}{}\n", camera.id,
                                 camera.model.empty() ? "" : " (" + camera.model + ")");
  for (const auto& mode : camera.modes) {
    std::vector<std::string> sizes;
    for (const auto& [width, height] : mode.sizes) {
      sizes.push_back(fmt::format("{}x{}", width, height));
    }
    const std::size_t more = sizes.size() > kMostSizes ? sizes.size() - kMostSizes : 0;
    if (more > 0) sizes.erase(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(more));
    text += fmt::format("  {:<8}{}{}\n", mode.format, fmt::join(sizes, " "),
                        more > 0 ? fmt::format(", and {} smaller", more) : "");
  }
  if (camera.fastest_hz > 0) {
    text += fmt::format("  rate    {:.4g} to {:.4g} Hz\n", camera.slowest_hz, camera.fastest_hz);
  } else {
    text += "  rate    its own: it has no control of it\n";
  }
  return text + (camera.settable.empty()
                     ? "  settable  nothing\n"
                     : fmt::format("  settable  {}\n", fmt::join(camera.settable, ", ")));
}

std::string textOf(const SeenImu& imu) {
  std::string text =
      fmt::format("IMU       {} ({}): {}\n", imu.name.empty() ? imu.id : imu.name, imu.id,
                  imu.gyro && imu.accel ? "gyroscope and accelerometer"
                  : imu.gyro            ? "gyroscope"
                                        : "accelerometer");
  text += fmt::format("  rates   {}\n", !imu.rates.empty() ? imu.rates + " Hz"
                                        : imu.rate_hz > 0  ? fmt::format("{} Hz now", imu.rate_hz)
                                                           : "it does not say");
  text += imu.triggers.empty()
              ? "  triggers  none: its buffer needs one, if the driver has none of its own\n"
              : fmt::format("  triggers  {}\n", fmt::join(imu.triggers, ", "));
  return text;
}

bool hasSize(const SeenCamera& camera, const std::pair<std::uint32_t, std::uint32_t>& size) {
  return std::ranges::any_of(camera.modes, [&](const auto& mode) {
    return std::ranges::find(mode.sizes, size) != mode.sizes.end();
  });
}

/// Returns the largest size that both cameras support, up to one megapixel, which suffices for vio.
std::string sizeFor(const SeenCamera& camera, const SeenCamera& other) {
  std::pair<std::uint32_t, std::uint32_t> best{0, 0};
  for (const auto& mode : camera.modes) {
    for (const auto& size : mode.sizes) {
      const std::uint64_t pixels = std::uint64_t{size.first} * size.second;
      const bool better = pixels <= 1'000'000 && pixels > std::uint64_t{best.first} * best.second;
      if (better && hasSize(other, size)) best = size;
    }
  }
  return best.first > 0 ? fmt::format("{}x{}", best.first, best.second) : "its size";
}

/// Returns a rate that both cameras support, or the default if a camera has no control for the
/// rate.
double rateFor(const SeenCamera& camera, const SeenCamera& other) {
  double rate = 20.0;
  for (const SeenCamera* of : {&camera, &other}) {
    if (of->fastest_hz <= 0) return 30.0;
    rate = std::min(rate, of->fastest_hz);
  }
  return rate;
}

std::string nameOf(const SeenImu& imu) { return imu.name.empty() ? imu.id : imu.name; }

/// Quotes a text for YAML, because ids contain backslashes and colons.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? "''" : std::string(1, c);
  return result + "'";
}

std::string configurationFor(const Seen& seen, const std::string& uri) {
  std::string text = "\n# to paste into capture.yaml\nsource: libcamera\n";
  if (seen.cameras.empty()) {
    text += "rig: rig.yaml  # perdure calibrate writes it\n# no camera was found\n";
  } else {
    const SeenCamera& camera = seen.cameras.front();
    const SeenCamera& other = seen.cameras.size() > 1 ? seen.cameras[1] : camera;
    text += fmt::format(
        "rig: rig.yaml  # of images of {}; perdure calibrate writes it\ncamera:\n  id: {}\n",
        sizeFor(camera, other), quoted(camera.id));
    if (&other != &camera) {
      text += fmt::format("  second: {}  # cam1 of the rig; leave it out for one camera\n",
                          quoted(other.id));
    }
    text += fmt::format("  rate_hz: {:.4g}\n", rateFor(camera, other));
  }
  const auto gyro =
      std::ranges::find_if(seen.imus, [](const SeenImu& imu) { return imu.gyro && imu.accel; });
  const auto alone = std::ranges::find_if(seen.imus, &SeenImu::gyro);
  const auto first = gyro != seen.imus.end() ? gyro : alone;
  if (first == seen.imus.end()) return text + "# no gyroscope was found\n";
  text += fmt::format("imu:\n  uri: {}\n  gyro: {}\n", quoted(uri), quoted(nameOf(*first)));
  const auto accel = std::ranges::find_if(seen.imus, &SeenImu::accel);
  if (!first->accel && accel != seen.imus.end()) {
    text += fmt::format("  accel: {}\n", quoted(nameOf(*accel)));
  }
  text += fmt::format("  rate_hz: {:.6g}\n", first->rate_hz >= 10 ? first->rate_hz : 200.0);
  if (first->triggers.size() == 1) {
    text += fmt::format("  trigger: {}\n", quoted(first->triggers.front()));
  }
  return text;
}

}  // namespace

Seen lookAround(const std::string& uri) {
  Seen seen;
  lookForCameras(seen);
  lookForImus(uri, seen);
  return seen;
}

std::string describe(const Seen& seen, const std::string& uri) {
  std::string text;
  for (const SeenCamera& camera : seen.cameras) text += textOf(camera);
  if (seen.cameras.empty()) {
    text +=
        "no camera: libcamera was asked (CSI ports and UVC cameras, /dev/video*, /dev/media*). Is "
        "it plugged in, and may you read it (group video)?\n";
  }
  for (const SeenImu& imu : seen.imus) text += textOf(imu);
  if (seen.imus.empty()) {
    text += fmt::format(
        "no IMU: {} of libiio was asked for devices with the channels anglvel or accel. Is its "
        "driver loaded (dmesg), and may you read /dev/iio:device* (group perdure)?\n",
        uri);
  }
  for (const std::string& problem : seen.problems) text += "note: " + problem + "\n";
  if (seen.cameras.empty() && seen.imus.empty()) return text;
  return text + configurationFor(seen, uri);
}

int listSensors(const std::vector<std::string>& arguments) {
  if (arguments.size() > 1 || (!arguments.empty() && arguments[0].starts_with("-"))) {
    std::fprintf(stderr,
                 "perdure-capture: --list stands alone, or with a context of libiio: "
                 "--list ip:HOST\n");
    return static_cast<int>(ExitCode::kUsage);
  }
  const std::string uri = arguments.empty() ? "local:" : arguments.front();
  const Seen seen = lookAround(uri);
  std::fputs(describe(seen, uri).c_str(), stdout);
  if (std::fflush(stdout) != 0) return static_cast<int>(ExitCode::kInputOutput);
  const bool nothing = seen.cameras.empty() && seen.imus.empty();
  return nothing ? static_cast<int>(ExitCode::kUnavailable) : 0;
}

}  // namespace perdure::capture
