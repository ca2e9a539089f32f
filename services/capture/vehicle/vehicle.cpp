#include "services/capture/vehicle/vehicle.h"

#include <fmt/format.h>
#include <linux/can.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "common/base/errors.h"
#include "services/capture/vehicle/gpsd.h"
#include "services/capture/vehicle/whole_number.h"

namespace perdure::capture {
namespace {

constexpr std::chrono::milliseconds kSpeedSilence{1500}, kGnssSilence{5000};

bool isAddress(const std::string& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  const auto port = wholeNumber(std::string_view(text).substr(colon + 1));
  return port && *port >= 1.0 && *port <= 65535.0 && *port == std::floor(*port);
}

void requireAddress(const char* key, const std::string& text) {
  if (isAddress(text)) return;
  throw StartupError(ExitCode::kConfiguration, "{}: \"{}\" is not HOST:PORT.", key, text);
}

std::uint32_t kernelId(const CanSignal& signal) {
  return signal.extended ? signal.id | CAN_EFF_FLAG : signal.id;
}

OpenSocket socketOf(const SpeedConfig& config) {
  if (config.source == "udp") return udpSocket(config.address);
  if (config.source != "can") return {};
  const auto settings = wheelSettings(config.can_signals, config.can_reverse, config.sigma);
  std::vector<std::uint32_t> ids;
  for (const CanSignal& signal : settings.wheels) ids.push_back(kernelId(signal));
  if (settings.reverse) ids.push_back(kernelId(*settings.reverse));
  return canSocket(config.can_interface, std::move(ids));
}

OpenSocket socketOf(const GnssConfig& config) {
  return config.source == "none" ? OpenSocket()
                                 : tcpSocket(config.address, std::string(kGpsdWatch));
}

AnchorSettings anchorSettings(const GnssConfig& config) {
  AnchorSettings settings{config.most_sigma, Eigen::Vector3d::Zero()};
  if (config.antenna.size() == 3) settings.antenna = Eigen::Vector3d(config.antenna.data());
  return settings;
}

std::string nameOf(const SpeedConfig& config) {
  return config.source == "can" ? "speed of " + config.can_interface : "speed at " + config.address;
}

std::string_view withoutBlanks(std::string_view text) {
  const auto first = text.find_first_not_of(" \t,"), last = text.find_last_not_of(" \t,");
  return first == std::string_view::npos ? std::string_view{}
                                         : text.substr(first, last - first + 1);
}

}  // namespace

Result<SpeedReading> readSpeedLine(std::string_view line, double sigma, std::int64_t time_ns) {
  const auto number = [](std::string_view& text, double& value) {
    text = withoutBlanks(text);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return text.empty() || text.find_first_of(" \t,") == 0;
  };
  constexpr double kFastest = 200.0;  // m/s
  // Ambiguous: 5,2 may mean 5.2, or 5 with a deviation of 2.
  if (line.find(',') != std::string_view::npos && line.find_first_of(" \t.") == line.npos) {
    return fail("speed_malformed",
                "a line of speed has a comma between two whole numbers; write a decimal point, and "
                "a blank before SIGMA");
  }
  SpeedReading reading{time_ns, 0.0, sigma};
  bool right = number(line, reading.speed);
  if (right && !withoutBlanks(line).empty()) right = number(line, reading.sigma) && line.empty();
  if (right && std::abs(reading.speed) > kFastest) {
    return fail("speed_malformed",
                "a line of speed says more than 200 m/s, which no vehicle has; is it in m/s?");
  }
  if (right && reading.sigma > 0.0) return reading;
  return fail("speed_malformed", "a line of speed is not \"SPEED\" or \"SPEED SIGMA\" in m/s");
}

void checkVehicle(const SpeedConfig& speed, const GnssConfig& gnss) {
  if (speed.source == "can") {
    (void)wheelSettings(speed.can_signals, speed.can_reverse, speed.sigma);
  }
  if (speed.source == "udp") requireAddress("speed.address", speed.address);
  if (gnss.source != "none") requireAddress("gnss.address", gnss.address);
}

Vehicle::Vehicle(const SpeedConfig& speed, const GnssConfig& gnss, Outputs outputs)
    : Vehicle(speed, gnss, std::move(outputs), socketOf(speed), socketOf(gnss)) {}

Vehicle::Vehicle(const SpeedConfig& speed, const GnssConfig& gnss, Outputs outputs,
                 OpenSocket speed_socket, OpenSocket gnss_socket)
    : speed_(speed),
      gnss_(gnss),
      outputs_(std::move(outputs)),
      anchor_(anchorSettings(gnss)),
      speed_ns_(HostClock::nowNs()),
      fix_ns_(HostClock::nowNs()) {
  if (speed.source == "can") {
    wheels_.emplace(wheelSettings(speed.can_signals, speed.can_reverse, speed.sigma));
  }
  if (speed_socket) {
    const bool can = speed.source == "can";
    const auto lines = [this](std::string_view line, std::int64_t t) { onSpeedLine(line, t); };
    speed_stream_ = std::make_unique<SocketStream>(
        "speed", nameOf(speed), kSpeedSilence, std::move(speed_socket),
        [this, can, lines](const Packet& packet) {
          if (can) return onCan(packet);
          said_.reset();
          speed_lines_.add(packet, lines);
          speed_lines_.end(packet.time_ns, lines);
          if (said_) give(*said_);  // a datagram gives one reading, its last
        });
  }
  if (gnss_socket) {
    const auto lines = [this](std::string_view line, std::int64_t t) { onGnssLine(line, t); };
    gnss_stream_ = std::make_unique<SocketStream>(
        "gnss", "gpsd at " + gnss.address, kGnssSilence, std::move(gnss_socket),
        [this, lines](const Packet& packet) { gnss_lines_.add(packet, lines); });
  }
}

void Vehicle::onCan(const Packet& packet) {
  // A classic frame has the same layout as a CAN FD frame: id, length, data from byte 8 on.
  canfd_frame frame{};
  if (packet.bytes.size() != CAN_MTU && packet.bytes.size() != CANFD_MTU) {
    return count(Of::kSpeed, {"speed_malformed", "what came of the CAN bus is no frame"});
  }
  std::memcpy(&frame, packet.bytes.data(), packet.bytes.size());
  const bool extended = (frame.can_id & CAN_EFF_FLAG) != 0;
  const std::uint32_t id = frame.can_id & (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  const std::size_t length =
      std::min<std::size_t>(frame.len, packet.bytes.size() == CAN_MTU ? 8 : 64);
  std::optional<SpeedReading> reading;
  {
    const std::lock_guard lock(mutex_);
    reading = wheels_->frame(id, extended, {frame.data, length}, packet.time_ns);
  }
  if (reading) give(*reading);
}

void Vehicle::onSpeedLine(std::string_view line, std::int64_t time_ns) {
  const auto reading = readSpeedLine(line, speed_.sigma, time_ns);
  if (!reading) return count(Of::kSpeed, reading.error());
  said_ = *reading;
}

void Vehicle::onGnssLine(std::string_view line, std::int64_t time_ns) {
  const auto fix = readGpsd(line, time_ns);
  if (!fix) return count(Of::kPlace, fix.error());
  if (*fix) take(**fix);
}

void Vehicle::take(GnssFix fix) {
  fix_ns_ = HostClock::nowNs();
  {
    const std::lock_guard lock(mutex_);
    gnss_trouble_.clear();
  }
  if (speed_.source == "gnss" && fix.speed) give({fix.time_ns, *fix.speed, speed_.sigma});
  if (!(fix.sigma_m <= gnss_.most_sigma)) {
    count(Of::kPlace,
          {"gnss_uncertain", fmt::format("the receiver of satellites states ±{:.1f} m, more than "
                                         "gnss.most_sigma: the map's place on Earth waits for less",
                                         fix.sigma_m)});
  }
  fix.time_ns -= std::llround(1e9 * gnss_.latency_s);
  if (const auto place = anchor_.offer(fix, backwards_)) outputs_.place(*place);
}

void Vehicle::give(SpeedReading reading) {
  speed_ns_ = HostClock::nowNs();
  {
    const std::lock_guard lock(mutex_);
    speed_trouble_.clear();
  }
  backwards_ = reading.speed < 0.0;
  reading.time_ns -= std::llround(1e9 * speed_.latency_s);
  outputs_.speed(reading);
}

void Vehicle::count(Of what, const Reason& reason) {
  const std::lock_guard lock(mutex_);
  reasons_.add(reason);
  (what == Of::kSpeed ? speed_trouble_ : gnss_trouble_) = reason.detail;
}

/// Returns a sentence if data arrive but give no readings; otherwise empty.
std::string Vehicle::silence() const {
  const std::int64_t now_ns = HostClock::nowNs();
  const auto flows = [](const std::unique_ptr<SocketStream>& stream) {
    return stream && stream->state().problem().empty();
  };
  std::string all;
  if (flows(gnss_stream_) && now_ns - fix_ns_ > std::chrono::nanoseconds(kGnssSilence).count()) {
    all = gnss_stream_->state().name() + " reports no fix.";
  }
  const auto& of_speed = speed_.source == "gnss" ? gnss_stream_ : speed_stream_;
  if (flows(of_speed) && now_ns - speed_ns_ > std::chrono::nanoseconds(kGnssSilence).count()) {
    all = joined(all, "What " + of_speed->state().name() + " says holds no speed.");
  }
  return all;
}

std::string Vehicle::problem() const {
  std::string all;
  const auto add = [&all](const std::string& more) {
    if (more.empty()) return;
    all = joined(all, more.back() == '.' ? more : more + ".");
  };
  for (const auto* stream : {speed_stream_.get(), gnss_stream_.get()}) {
    if (stream) add(stream->state().problem());
  }
  add(silence());
  const std::lock_guard lock(mutex_);
  add(wheels_ ? wheels_->trouble() : speed_trouble_);
  add(gnss_trouble_);
  return all;
}

std::string Vehicle::name() const {
  std::string all;
  for (const auto* stream : {speed_stream_.get(), gnss_stream_.get()}) {
    if (stream) all = joined(all, stream->state().name(), "; ");
  }
  return all;
}

void Vehicle::report(ReasonCounts& counts) const {
  for (const auto* stream : {speed_stream_.get(), gnss_stream_.get()}) {
    if (stream) counts.add(stream->state().reasons());
  }
  const std::lock_guard lock(mutex_);
  counts.add(reasons_);
  if (wheels_) counts.add(wheels_->reasons());
}

}  // namespace perdure::capture
