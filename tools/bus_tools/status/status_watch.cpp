#include "tools/bus_tools/status/status_watch.h"

#include <unistd.h>

#include <fstream>
#include <sstream>

#include "common/base/algorithms/median.h"
#include "tools/bus_tools/common.h"

namespace perdure::tools {
namespace {

constexpr double kSettle = 0.5;  // s; time in which latched samples arrive

/// Time from capture until now, in ms; below 0 if the message has no stamp of this host.
template <class T>
double latencyOf(const T& message) {
  constexpr double kLongest = 1e4;  // ms
  if constexpr (requires { message.stamp.captured_ns; }) {
    const double ms = 1e3 * steadySeconds() - 1e-6 * static_cast<double>(message.stamp.captured_ns);
    return message.stamp.captured_ns > 0 && ms < kLongest ? ms : -1.0;
  }
  return -1.0;
}

/// Seconds since the start of the process, from /proc; empty if no Perdure process has this pid.
std::optional<double> upSeconds(std::uint32_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat"), uptime("/proc/uptime");
  std::string line;
  double now = 0.0;
  if (!std::getline(stat, line) || !(uptime >> now)) return std::nullopt;
  const auto end = line.rfind(')');
  if (end == std::string::npos || line.find("(perdure") == std::string::npos) return std::nullopt;
  std::istringstream fields(line.substr(end + 1));
  std::string skipped;
  for (int i = 0; i < 19; ++i) fields >> skipped;
  double ticks = 0.0;
  if (!(fields >> ticks)) return std::nullopt;
  return now - ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

}  // namespace

StatusWatch::StatusWatch(const bus::Options& options)
    : options_(options),
      domain_(options),
      participant_(domain_, "perdure status"),
      discovery_(participant_),
      loop_(participant_),
      start_s_(steadySeconds()) {
  for (const bus::TopicInfo& info : bus::topicTable()) {
    const std::string name(info.name);
    // Maps and images are large, and their content is not needed here.
    if (name.ends_with('/') || name == "map" || name == "object_state") continue;
    bus::withTopic(name, [&](const auto& topic) { listen(topic); });
  }
}

template <class T>
void StatusWatch::listen(const bus::Topic<T>& topic) {
  auto reader = std::make_shared<bus::Reader<T>>(participant_, topic);
  readers_.push_back(reader);
  loop_.on(*reader, [this, &heard = topics_[topic.name]](const T& message) {
    if constexpr (std::is_same_v<T, Health>) note(message);
    if constexpr (std::is_same_v<T, Calibration>) calibration_ = message;
    if constexpr (std::is_same_v<T, MapHeader>) map_header_ = message;
    if constexpr (std::is_same_v<T, MapFrame>) map_frame_ = message;
    arrived(heard, latencyOf(message));
  });
}

void StatusWatch::note(const Health& health) {
  if (on_health_) on_health_(health);
  Process& process = processes_[health.process];
  const double at = steadySeconds();
  const bool same = process.last.instance == health.instance && process.last_s > 0;
  if (!same && settled(at)) process.began_s = at;
  if (!same && process.last_s > 0) ++process.restarts;
  process.before = same ? process.last : Health{};
  process.before_s = same && settled(process.last_s) ? process.last_s : -1.0;
  process.last = health;
  process.last_s = at;
}

bool StatusWatch::settled(double now) const { return now - start_s_ > kSettle; }

void StatusWatch::arrived(Heard& heard, double latency_ms) {
  constexpr std::size_t kMost = 100;
  const double at = steadySeconds();
  if (!settled(at)) return;
  heard.last_s = at;
  heard.rate.arrived(at);
  if (latency_ms < 0) return;
  heard.latency_ms.push_back(latency_ms);
  if (heard.latency_ms.size() > kMost) heard.latency_ms.pop_front();
}

ServiceSeen StatusWatch::seenOf(const Process& process, double at) const {
  ServiceSeen seen{process.last, at - process.last_s,         process.last.rate_hz,
                   -1.0,         upSeconds(process.last.pid), process.restarts};
  if (!seen.up_s && process.began_s > 0) seen.up_s = at - process.began_s;
  const double span = process.last_s - process.before_s;
  if (process.before_s < 0 || span <= 0) return seen;
  seen.frames_hz = static_cast<double>(process.last.frames_out - process.before.frames_out) / span;
  seen.cpu = (process.last.cpu_s - process.before.cpu_s) / span;
  return seen;
}

StatusSeen StatusWatch::seen() {
  StatusSeen seen;
  seen.vehicle = options_.vehicle;
  seen.calibration = calibration_;
  seen.map_header = map_header_;
  seen.map_frame = map_frame_;
  const double at = steadySeconds();
  for (const auto& [name, process] : processes_) seen.services[name] = seenOf(process, at);
  for (auto& [name, heard] : topics_) {
    TopicSeen& topic = seen.topics[name];
    const RateSummary rate = heard.rate.summary(at);
    topic.messages = rate.messages;
    topic.rate_hz = rate.rate_hz;
    if (heard.last_s > 0) topic.age_s = at - heard.last_s;
    if (!heard.latency_ms.empty()) topic.latency_ms = medianOf(heard.latency_ms);
  }
  const std::string prefix = participant_.wireName("");
  for (const bus::RemoteEndpoint& endpoint : discovery_.endpoints()) {
    if (!endpoint.wire_name.starts_with(prefix) || endpoint.process == "perdure status") continue;
    TopicSeen& topic = seen.topics[endpoint.wire_name.substr(prefix.size())];
    ++(endpoint.writer ? topic.writers : topic.readers);
    if (endpoint.writer && !endpoint.process.empty()) topic.written_by.insert(endpoint.process);
  }
  return seen;
}

}  // namespace perdure::tools
