#include "services/capture/live/iio_stream.h"

#include <fmt/format.h>
#include <iio.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "services/capture/live/clocks.h"

namespace perdure::capture {
namespace {

constexpr double kBlock_s = 0.01;       // samples of this duration are read at once
constexpr unsigned kTimeout_ms = 1000;  // without a sample for this long, the device counts as lost

std::string sayError(ssize_t code) {
  char text[128];
  iio_strerror(static_cast<int>(-code), text, sizeof text);
  return text;
}

/// Returns a numeric attribute of a channel, or nothing if it cannot be read.
std::optional<double> readNumber(const iio_channel* channel, const char* attribute) {
  double value = 0.0;
  if (iio_channel_attr_read_double(channel, attribute, &value) < 0) return std::nullopt;
  return value;
}

std::string readText(const iio_device* device, const char* attribute) {
  char text[256] = {};
  return iio_device_attr_read(device, attribute, text, sizeof text) > 0 ? trimmed(text) : "";
}

std::string readText(const iio_channel* channel, const char* attribute) {
  char text[256] = {};
  if (!channel || iio_channel_attr_read(channel, attribute, text, sizeof text) <= 0) return "";
  return trimmed(text);
}

/// Requests a rate, and returns the rate that the device has set, because many devices support only
/// a few rates. Returns nothing if the device has no rate attribute.
std::optional<double> askRate(const iio_device* device, double wanted) {
  constexpr const char* kRate = "sampling_frequency";
  if (!iio_device_find_attr(device, kRate)) return std::nullopt;
  (void)!iio_device_attr_write_double(device, kRate, wanted);
  double is = 0.0;
  if (iio_device_attr_read_double(device, kRate, &is) < 0 || is <= 0.0) return std::nullopt;
  return is;
}

std::optional<double> askRate(const iio_channel* channel, double wanted) {
  constexpr const char* kRate = "sampling_frequency";
  if (!iio_channel_find_attr(channel, kRate)) return std::nullopt;
  (void)!iio_channel_attr_write_double(channel, kRate, wanted);
  const auto is = readNumber(channel, kRate);
  return is && *is > 0.0 ? is : std::nullopt;
}

struct Axis {
  iio_channel* channel = nullptr;
  double scale = 1.0, offset = 0.0;

  double value(const void* at) const {
    const iio_data_format* format = iio_channel_get_data_format(channel);
    std::int64_t raw = 0;
    iio_channel_convert(channel, &raw, at);
    const auto bytes = format->length / 8;
    if (format->is_signed && bytes < 8) {  // the conversion fills only the bytes of its length
      const unsigned shift = 64 - 8 * bytes;
      raw = static_cast<std::int64_t>(static_cast<std::uint64_t>(raw) << shift) >> shift;
    }
    return (static_cast<double>(raw) + offset) * scale;
  }
};

using Axes = std::array<Axis, 3>;

std::optional<Axes> axesOf(const iio_device* device, const std::string& kind) {
  Axes axes;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string id = kind + "_" + "xyz"[i];
    axes[i].channel = iio_device_find_channel(device, id.c_str(), false);
    if (!axes[i].channel || !iio_channel_is_scan_element(axes[i].channel)) return std::nullopt;
    axes[i].scale = readNumber(axes[i].channel, "scale").value_or(1.0);
    axes[i].offset = readNumber(axes[i].channel, "offset").value_or(0.0);
  }
  return axes;
}

/// Selects the clock of a local device's stamps, and returns the clock. A device in the network has
/// its own clock.
StampClock clockOf(const iio_context* context, const iio_device* device) {
  if (std::strcmp(iio_context_get_name(context), "local") != 0) return StampClock::kElsewhere;
  (void)!iio_device_attr_write(device, "current_timestamp_clock", "boottime");
  return stampClockNamed(readText(device, "current_timestamp_clock"));
}

struct ContextDeleter {
  void operator()(iio_context* context) const { iio_context_destroy(context); }
};
struct BufferDeleter {
  void operator()(iio_buffer* buffer) const { iio_buffer_destroy(buffer); }
};

}  // namespace

/// An open device. Its members destroy the buffer before the context.
class IioStream::Device {
 public:
  /// Opens the device. Fails with "imu_absent"; the detail is a sentence with the fix.
  static Result<std::unique_ptr<Device>> open(const IioSettings& settings) {
    auto device = std::unique_ptr<Device>(new Device);
    for (const auto& step : {&Device::connect, &Device::choose, &Device::setUp, &Device::start}) {
      if (const auto done = (device.get()->*step)(settings); !done) {
        return tl::unexpected(done.error());
      }
    }
    return device;
  }

  iio_buffer* buffer() const { return buffer_.get(); }
  std::uint64_t jumps() const { return map_.jumps(); }
  std::string name() const {
    const char* name = iio_device_get_name(device_);
    return fmt::format("{} at {:g} Hz", name ? name : iio_device_get_id(device_), rate_hz_);
  }

  /// Waits for a block and passes on its scans. Returns the number of scans, or a negative error.
  ssize_t read(const std::function<void(const IioScan&)>& give) {
    const ssize_t bytes = iio_buffer_refill(buffer_.get());
    if (bytes < 0) return bytes;
    const std::int64_t now_ns = HostClock::nowNs();
    const auto step = iio_buffer_step(buffer_.get());
    const auto* end = static_cast<const char*>(iio_buffer_end(buffer_.get()));
    const auto* at = static_cast<const char*>(iio_buffer_start(buffer_.get()));
    const ssize_t scans = (end - at) / step;
    for (ssize_t i = 0; i < scans; ++i, at += step) {
      if (const auto time = timeOf(i, scans, now_ns)) give(scanAt(i, *time));
    }
    counted_ += scans;
    return scans;
  }

 private:
  Device() = default;

  Result<void> connect(const IioSettings& settings) {
    const std::string uri(settings.uri.c_str());  // libiio 0.24 writes into a URI with a port
    context_.reset(iio_create_context_from_uri(uri.c_str()));
    if (!context_) {
      return fail("imu_absent", fmt::format("no IIO context at {}: {}; is the driver loaded, or "
                                            "iiod running there? See imu.uri.",
                                            settings.uri, sayError(-errno)));
    }
    (void)iio_context_set_timeout(context_.get(), kTimeout_ms);
    return {};
  }

  Result<void> choose(const IioSettings& settings) {
    std::string there;
    for (unsigned i = 0; i < iio_context_get_devices_count(context_.get()); ++i) {
      iio_device* device = iio_context_get_device(context_.get(), i);
      const std::string id = iio_device_get_id(device);
      const char* given = iio_device_get_name(device);
      const std::string name = given ? given : id;
      there += (there.empty() ? "" : ", ") + name;
      if (!settings.device.empty() && settings.device != name && settings.device != id) continue;
      gyro_ = settings.gyro ? axesOf(device, "anglvel") : std::nullopt;
      accel_ = settings.accel ? axesOf(device, "accel") : std::nullopt;
      if (settings.gyro != gyro_.has_value() || settings.accel != accel_.has_value()) continue;
      device_ = device;
      return {};
    }
    const char* what = settings.gyro && settings.accel ? "an accelerometer and a gyroscope"
                       : settings.gyro                 ? "a gyroscope"
                                                       : "an accelerometer";
    return fail("imu_absent",
                fmt::format("no device{} with {} that can be buffered at {} (there are: {}); see "
                            "imu.gyro and imu.accel.",
                            settings.device.empty() ? "" : " " + settings.device, what,
                            settings.uri, there.empty() ? "none" : there));
  }

  Result<void> setUp(const IioSettings& settings) {
    if (const auto set = setTrigger(settings.trigger); !set) return set;
    mount_.setIdentity();
    if (settings.mount.size() == 9) {
      mount_ =
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(settings.mount.data());
    } else if (const auto own = parseMount(mountText())) {
      mount_ = *own;
    }
    setRate(settings.rate_hz);
    clock_ = clockOf(context_.get(), device_);
    return {};
  }

  Result<void> setTrigger(const std::string& named) {
    if (named.empty()) {
      (void)!iio_device_get_trigger(device_, &trigger_);
      return {};
    }
    trigger_ = iio_context_find_device(context_.get(), named.c_str());
    const int code = trigger_ ? iio_device_set_trigger(device_, trigger_) : -ENODEV;
    if (code >= 0) return {};
    return fail("imu_absent", fmt::format("the trigger {} cannot be set: {}; see imu.trigger.",
                                          named, sayError(code)));
  }

  /// Returns the device's mount matrix as text. libiio assigns a matrix for all channels,
  /// "in_mount_matrix", to a channel "mount".
  std::string mountText() const {
    if (const auto text = readText(device_, "mount_matrix"); !text.empty()) return text;
    const iio_channel* shared = iio_device_find_channel(device_, "mount", false);
    if (const auto text = readText(shared, "matrix"); !text.empty()) return text;
    return readText((gyro_ ? *gyro_ : *accel_)[0].channel, "mount_matrix");
  }

  /// Requests the rate from the device and from its trigger, which determines when scans occur.
  void setRate(double wanted) {
    rate_hz_ = askRate(device_, wanted).value_or(wanted);
    for (const auto& axes : {gyro_, accel_}) {
      if (axes) rate_hz_ = askRate((*axes)[0].channel, wanted).value_or(rate_hz_);
    }
    if (trigger_) rate_hz_ = askRate(trigger_, wanted).value_or(rate_hz_);
  }

  Result<void> start(const IioSettings&) {
    for (const auto& axes : {gyro_, accel_}) {
      if (!axes) continue;
      for (const Axis& axis : *axes) iio_channel_enable(axis.channel);
    }
    stamp_ = iio_device_find_channel(device_, "timestamp", false);
    if (stamp_) iio_channel_enable(stamp_);
    const auto samples = std::max(1.0, std::round(kBlock_s * rate_hz_));
    buffer_.reset(iio_device_create_buffer(device_, static_cast<std::size_t>(samples), false));
    if (!buffer_) {
      return fail(
          "imu_absent",
          "{} gives no buffer: {}; it needs a trigger (imu.trigger), or another program reads it.",
          name(), sayError(-errno));
    }
    return {};
  }

  std::optional<std::int64_t> timeOf(ssize_t i, ssize_t scans, std::int64_t now_ns) {
    std::int64_t stamp = 0;
    if (stamp_) {
      iio_channel_convert(stamp_, &stamp, at(stamp_, i));
    } else {  // the time follows from the number of samples and the device's rate
      stamp = std::llround(1e9 * static_cast<double>(counted_ + i) / rate_hz_);
    }
    if (!stamp_ || clock_ == StampClock::kElsewhere) {
      if (i == 0) observe(scans, now_ns);
      return map_.toOurs(stamp);
    }
    if (clock_ == StampClock::kMonotonic) return stamp + HostClock::monotonicToBootNs();
    if (clock_ == StampClock::kRealtime) return stamp + HostClock::realtimeToBootNs();
    return stamp;
  }

  /// Observes the remote clock with the last scan of a block, because a block arrives with its last
  /// scan.
  void observe(ssize_t scans, std::int64_t now_ns) {
    std::int64_t last = 0;
    if (stamp_) {
      iio_channel_convert(stamp_, &last, at(stamp_, scans - 1));
    } else {
      last = std::llround(1e9 * static_cast<double>(counted_ + scans - 1) / rate_hz_);
    }
    map_.observe(last, now_ns);
  }

  const void* at(const iio_channel* channel, ssize_t scan) const {
    return static_cast<const char*>(iio_buffer_first(buffer_.get(), channel)) +
           scan * iio_buffer_step(buffer_.get());
  }

  IioScan scanAt(ssize_t i, std::int64_t time_ns) const {
    const auto read = [&](const Axes& axes) {
      Eigen::Vector3d v;
      for (int k = 0; k < 3; ++k) {
        const Axis& axis = axes[static_cast<std::size_t>(k)];
        v[k] = axis.value(at(axis.channel, i));
      }
      return Eigen::Vector3d(mount_ * v);
    };
    IioScan scan;
    scan.time_ns = time_ns;
    if (gyro_) scan.gyro = read(*gyro_);
    if (accel_) scan.accel = read(*accel_);
    return scan;
  }

  std::unique_ptr<iio_context, ContextDeleter> context_;
  iio_device* device_ = nullptr;
  const iio_device* trigger_ = nullptr;
  std::optional<Axes> gyro_, accel_;
  iio_channel* stamp_ = nullptr;
  Eigen::Matrix3d mount_;
  double rate_hz_ = 0.0;
  StampClock clock_ = StampClock::kElsewhere;
  ClockMap map_;
  std::int64_t counted_ = 0;
  std::unique_ptr<iio_buffer, BufferDeleter> buffer_;
};

IioStream::IioStream(IioSettings settings, std::function<void(const IioScan&)> give)
    : settings_(std::move(settings)), give_(std::move(give)), thread_([this] { run(); }) {}

IioStream::~IioStream() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    if (open_) iio_buffer_cancel(open_);
  }
  thread_.join();
}

void IioStream::run() {
  // Writing to a closed socket must return an error instead of a signal.
  sigset_t pipe;
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
  keepOpen(stopping_, [this] {
    if (auto device = Device::open(settings_)) {
      flow(**device);
    } else {
      state_.fails(device.error());
    }
  });
}

void IioStream::flow(Device& device) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    open_ = device.buffer();
  }
  ssize_t got = 0;
  std::uint64_t jumps = 0;
  while (!stopping_ && (got = device.read(give_)) >= 0) {
    state_.flows(device.name());
    if (device.jumps() > jumps) state_.count("imu_clock_jump", device.jumps() - jumps);
    jumps = device.jumps();
  }
  {
    const std::lock_guard lock(mutex_);
    open_ = nullptr;
  }
  if (stopping_) return;
  state_.fails(
      {"imu_lost", fmt::format("the IMU {} at {} gives nothing any more: {}; it is tried again.",
                               device.name(), settings_.uri, sayError(got))});
}

std::string trimmed(std::string_view text) {
  constexpr std::string_view kSpace(" \t\r\n\0", 5);
  const auto first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(kSpace) + 1 - first));
}

StampClock stampClockNamed(std::string_view text) {
  const std::string name = trimmed(text);
  if (name == "boottime") return StampClock::kBoot;
  if (name == "monotonic" || name == "monotonic_coarse") return StampClock::kMonotonic;
  if (name == "realtime" || name == "realtime_coarse") return StampClock::kRealtime;
  return StampClock::kElsewhere;
}

std::optional<Eigen::Matrix3d> parseMount(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
  std::istringstream in(text);
  Eigen::Matrix3d R;
  for (int i = 0; i < 9; ++i) {
    if (!(in >> R(i / 3, i % 3))) return std::nullopt;
  }
  return R;
}

}  // namespace perdure::capture
