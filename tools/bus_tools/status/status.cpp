#include "tools/bus_tools/status/status.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/bus/discovery.h"
#include "common/types/health.h"
#include "tools/bus_tools/common.h"

namespace perdure::tools {
namespace {

constexpr double kSilentHealth = 1.5;  // s; a process is silent then, as Health comes each second
constexpr double kJustStarted = 5.0;   // s; a process that started since then is degraded
constexpr double kSlow = 0.8;          // share of the expected rate, below which it is degraded
constexpr double kLate = 200.0;        // ms since capture, above which data are late

Level levelOf(HealthState state) {
  if (state == HealthState::kOk) return Level::kOk;
  return state == HealthState::kFailed ? Level::kFailed : Level::kDegraded;
}

void addSentence(std::string& text, const std::string& sentence) {
  if (!sentence.empty()) text += (text.empty() ? "" : "; ") + sentence;
}

/// Formats a time span: "48 s", "12 min", "5 h", "3 d".
std::string spanText(double seconds) {
  constexpr double kMinute = 60.0, kHour = 3600.0, kDay = 86400.0;
  if (seconds < 2 * kMinute) return fmt::format("{:.0f} s", seconds);
  if (seconds < 2 * kHour) return fmt::format("{:.0f} min", seconds / kMinute);
  if (seconds < 2 * kDay) return fmt::format("{:.0f} h", seconds / kHour);
  return fmt::format("{:.0f} d", seconds / kDay);
}

/// State of the data source. Topics are expected only after it has started and before it ends.
struct Source {
  bool gives = false;
  std::string why_not;
  const Health* heard = nullptr;  ///< Health of capture
};

bool isHeard(const StatusSeen& seen, const std::string& process) {
  const auto it = seen.services.find(process);
  return it != seen.services.end() && it->second.age_s <= kSilentHealth;
}

Source sourceOf(const StatusSeen& seen) {
  const auto it = seen.services.find("capture");
  if (it == seen.services.end()) return {true, {}};
  const Health& health = it->second.health;
  if (health.message == kEndOfDrive)
    return {false, health.message, isHeard(seen, "capture") ? &health : nullptr};
  if (health.state == HealthState::kStarting) return {false, "capture is starting"};
  return {true, {}};
}

StatusNode judgeService(const std::string& name, const ServiceSeen* seen, const Source& source) {
  StatusNode node{name};
  if (seen == nullptr) {
    node.level = Level::kFailed;
    node.text = "is not heard; does it run, with the same bus.interface and bus.domain?";
    return node;
  }
  const Health& h = seen->health;
  node.data = {
      {"pid", h.pid},
      {"state", nameOf(h.state)},
      {"age_s", seen->age_s},
      {"message", h.message},
      {"frames_in", h.frames_in},
      {"frames_out", h.frames_out},
      {"dropped", h.dropped},
      {"frames_hz", seen->frames_hz},
      {"cpu", seen->cpu < 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(seen->cpu)},
      {"rss_bytes", h.rss_bytes},
      {"reasons", h.reasons}};
  if (seen->age_s > kSilentHealth) {
    node.level = Level::kFailed;
    node.text = fmt::format("says nothing for {:.1f} s: it is stopped, hangs, or is gone (pid {})",
                            seen->age_s, h.pid);
    return node;
  }
  const bool ended = endedWith(source.heard, h);
  node.level = ended ? Level::kOk : levelOf(h.state);
  node.text = fmt::format("{:.1f} Hz  in {} out {} dropped {}  {} MB", seen->frames_hz, h.frames_in,
                          h.frames_out, h.dropped, h.rss_bytes >> 20);
  if (seen->cpu >= 0) node.text += fmt::format("  {:.0f} % CPU", 100 * seen->cpu);
  if (node.level != Level::kOk) node.text = std::string(nameOf(h.state)) + "  " + node.text;
  if (seen->up_s) {
    node.data["up_s"] = *seen->up_s;
    if (*seen->up_s >= kJustStarted) node.text += "  up " + spanText(*seen->up_s);
  }
  addSentence(node.text, ended ? std::string("nothing more comes: ") + kEndOfDrive : h.message);
  if (ended) node.data["ended"] = true;
  if (seen->restarts > 0) {
    node.data["restarts"] = seen->restarts;
    addSentence(node.text, fmt::format("was started anew {} times meanwhile", seen->restarts));
  }
  if (seen->up_s && *seen->up_s < kJustStarted) {
    node.level = std::max(node.level, Level::kDegraded);
    addSentence(node.text, fmt::format("started {:.1f} s ago", *seen->up_s));
  }
  return node;
}

/// The process that writes the topics of `service` while that is silent; empty if there is none.
std::string standInFor(const StatusSeen& seen, const std::string& service) {
  if (isHeard(seen, service)) return {};
  for (const auto& [name, topic] : seen.topics) {
    for (const std::string& process : topic.written_by) {
      if (bus::standsIn(service, name, process)) return process;
    }
  }
  return {};
}

/// Node of a service that another process replaces. The nodes "sensors" and "topics" judge the
/// data.
StatusNode standingIn(const StatusSeen& seen, const std::string& service,
                      const std::string& process) {
  std::string topics;
  for (const auto& [name, topic] : seen.topics) {
    if (bus::standsIn(service, name, process) && topic.written_by.contains(process))
      topics += (topics.empty() ? "" : ", ") + name;
  }
  StatusNode node{service};
  node.text = process + " stands in for it: it writes " + topics;
  node.data = {{"stand_in", process}};
  return node;
}

StatusNode judgeServices(const StatusSeen& seen, const Source& source) {
  StatusNode node{"services"};
  for (const char* name : kUsualServices) {
    const auto it = seen.services.find(name);
    if (const std::string process = standInFor(seen, name); !process.empty()) {
      node.add(standingIn(seen, name, process));
    } else {
      node.add(judgeService(name, it == seen.services.end() ? nullptr : &it->second, source));
    }
  }
  for (const auto& [name, service] : seen.services) {
    const bool usual = std::ranges::find(kUsualServices, name) != std::end(kUsualServices);
    if (!usual) node.add(judgeService(name, &service, source));
  }
  return node;
}

std::string figuresOf(const TopicSeen& topic, double expected) {
  std::string text = expected > 0 ? fmt::format("{:.1f} of {:g} Hz", topic.rate_hz, expected)
                                  : fmt::format("{:.1f} Hz", topic.rate_hz);
  if (topic.age_s && *topic.age_s > 0) text += fmt::format("  {:.2f} s ago", *topic.age_s);
  if (topic.latency_ms) text += fmt::format("  {:.0f} ms from capture", *topic.latency_ms);
  return text;
}

StatusNode judgeBeat(StatusNode node, const TopicSeen& topic, double expected,
                     const Source& source) {
  const double patience = std::max(0.5, 5.0 / expected);
  node.text = figuresOf(topic, expected);
  if (!source.gives) {
    addSentence(node.text, source.why_not);
  } else if (topic.writers == 0) {
    node.level = Level::kFailed;
    addSentence(node.text, "nobody writes it");
  } else if (!topic.age_s || *topic.age_s > patience) {
    node.level = Level::kFailed;
    addSentence(node.text, "silent");
  } else if (topic.rate_hz < kSlow * expected) {
    node.level = Level::kDegraded;
    addSentence(node.text, "too slow");
  } else if (topic.latency_ms.value_or(0.0) > kLate) {
    node.level = Level::kDegraded;
    addSentence(node.text, "late");
  }
  return node;
}

StatusNode judgeTopic(const std::string& name, const TopicSeen& topic, double expected,
                      const Source& source) {
  StatusNode node{name};
  node.data = {{"writers", topic.writers}, {"readers", topic.readers}};
  node.data["expected_hz"] = expected;
  node.data["rate_hz"] = topic.rate_hz;
  if (topic.age_s) node.data["age_s"] = *topic.age_s;
  if (topic.latency_ms) node.data["latency_ms"] = *topic.latency_ms;
  if (expected > 0) return judgeBeat(std::move(node), topic, expected, source);
  node.text = fmt::format("on change  {} writers, {} readers", topic.writers, topic.readers);
  if (topic.age_s) node.text += fmt::format("  {:.1f} s ago", *topic.age_s);
  return node;
}

double cameraRate(const StatusSeen& seen, const std::string& camera) {
  if (!seen.calibration) return 0.0;
  for (const CameraCalibration& c : seen.calibration->cameras) {
    if (c.name == camera || camera.empty()) return c.rate_hz;
  }
  return 0.0;
}

double imuRate(const StatusSeen& seen) {
  return seen.calibration && seen.calibration->imu ? seen.calibration->imu->rate_hz : 0.0;
}

double expectedOf(const StatusSeen& seen, const std::string& name) {
  const bus::TopicInfo* info = bus::findTopic(name);
  if (info == nullptr || name == "speed") return 0.0;  // speed has no fixed rate
  const std::string camera = name.starts_with("frame/") ? name.substr(6) : "";
  return bus::expectedRate(*info, cameraRate(seen, camera), imuRate(seen));
}

StatusNode judgeTopics(const StatusSeen& seen, const Source& source) {
  StatusNode node{"topics"};
  const std::string foreign_odometry = standInFor(seen, "vio");
  for (const auto& [name, topic] : seen.topics) {
    // judged as a sensor
    if (name.starts_with("frame/") || name == "imu" || name == "speed") continue;
    // judged as a service
    if (name == "health") continue;
    const bool none = name == "landmarks" && topic.writers == 0 && !foreign_odometry.empty();
    node.add(judgeTopic(name, topic, none ? 0.0 : expectedOf(seen, name), source));
    if (none)
      addSentence(node.children.back().text, "the odometry of " + foreign_odometry + " has none");
  }
  return node;
}

/// Takes the frame rate from the Health of the source, because images are too large to be read
/// here.
TopicSeen framesOf(const StatusSeen& seen, const std::string& source, TopicSeen topic) {
  if (!isHeard(seen, source)) return topic;
  const auto capture = seen.services.find(source);
  topic.rate_hz = capture->second.frames_hz;
  topic.age_s.reset();
  if (topic.rate_hz > 0) topic.age_s = 0.0;
  return topic;
}

StatusNode judgeSpeed(StatusNode node, const TopicSeen& topic, const Source& source) {
  constexpr double kPatience = 1.0;  // s
  if (source.gives && topic.age_s.value_or(kPatience + 1) > kPatience) {
    node.level = Level::kFailed;
    addSentence(node.text, "silent");
  }
  return node;
}

StatusNode judgeSensors(const StatusSeen& seen, const Source& source) {
  StatusNode node{"sensors"};
  const std::string stand_in = standInFor(seen, "capture");
  const std::string source_of_frames = stand_in.empty() ? "capture" : stand_in;
  if (!seen.calibration) {
    node.level = Level::kDegraded;
    node.text =
        "no calibration is heard: " + source_of_frames + " gives it when it has found its source";
  }
  for (const auto& [name, topic] : seen.topics) {
    if (name.starts_with("frame/")) {
      const bool somebody_has_it = expectedOf(seen, name) > 0 || topic.writers > 0;
      if (!somebody_has_it) continue;
      // Without Health of the stand-in, the frame rate is unknown.
      const bool told = stand_in.empty() || isHeard(seen, stand_in);
      node.add(judgeTopic(name, framesOf(seen, source_of_frames, topic),
                          told ? expectedOf(seen, name) : 0.0, source));
    } else if (name == "imu") {
      node.add(judgeTopic(name, topic, expectedOf(seen, name), source));
    } else if (name == "speed" && seen.calibration && seen.calibration->has_speed) {
      node.add(judgeSpeed(judgeTopic(name, topic, 0.0, source), topic, source));
    }
  }
  return node;
}

StatusNode judgeDisk(const DiskSeen& disk) {
  constexpr std::uint64_t kLittle = 1ULL << 30, kNone = 100ULL << 20;
  StatusNode node{"disk " + disk.folder};
  node.data = {{"free_bytes", disk.free_bytes}, {"all_bytes", disk.all_bytes}};
  node.text = fmt::format("{:.1f} of {:.1f} GB free", 1e-9 * static_cast<double>(disk.free_bytes),
                          1e-9 * static_cast<double>(disk.all_bytes));
  if (disk.free_bytes >= kLittle) return node;
  node.level = disk.free_bytes >= kNone ? Level::kDegraded : Level::kFailed;
  addSentence(node.text, "make room: the map is kept there");
  return node;
}

StatusNode judgeTemperature(const TemperatureSeen& t) {
  constexpr double kNear = 10.0, kUsual = 95.0;  // °C
  StatusNode node{"temperature " + t.where};
  const double critical = t.critical.value_or(kUsual);
  node.data = {{"celsius", t.celsius}, {"critical_celsius", critical}};
  node.text = fmt::format("{:.0f} °C of {:.0f} °C", t.celsius, critical);
  if (t.celsius > critical - kNear) {
    node.level = Level::kDegraded;
    addSentence(node.text, "it will soon be throttled: cool it");
  }
  return node;
}

StatusNode judgeClock(const StatusSeen& seen) {
  StatusNode node{"clock"};
  std::uint64_t steps = 0;
  bool just_now = false;
  for (const auto& [name, service] : seen.services) {
    const auto& reasons = service.health.reasons;
    if (const auto it = reasons.find("wall_clock_stepped"); it != reasons.end()) {
      steps = std::max(steps, it->second);
    }
    just_now = just_now || reasons.contains("wall_clock_stepped_just_now");
  }
  node.data = {{"synchronised", seen.host.clock_synchronised}, {"steps", steps}};
  node.text = seen.host.clock_synchronised ? "synchronised" : "not synchronised";
  if (steps > 0) addSentence(node.text, fmt::format("was set {} times", steps));
  if (just_now) {
    node.level = Level::kDegraded;
    addSentence(node.text, "just now; Perdure goes on by the monotonic clock");
  }
  if (seen.host.several_hosts && !seen.host.clock_synchronised) {
    node.level = Level::kDegraded;
    addSentence(node.text, "across hosts run ptp4l and phc2sys, or chrony");
  }
  return node;
}

std::uint64_t refusals(const StatusSeen& seen) {
  std::uint64_t n = 0;
  for (const auto& [name, service] : seen.services) {
    for (const auto& [reason, count] : service.health.reasons) {
      if (reason.starts_with("security_refused_")) n += count;
    }
  }
  return n;
}

/// Judges the identities on this host: failed if one is unusable, otherwise by the first expiry.
StatusNode judgeSecurity(const StatusSeen& seen) {
  StatusNode node{"security"};
  const IdentitySeen* first = nullptr;
  for (const IdentitySeen& identity : seen.host.identities) {
    if (!identity.until) {
      node.level = Level::kFailed;
      addSentence(node.text, identity.problem);
    } else if (first == nullptr || identity.until < first->until) {
      first = &identity;
    }
  }
  if (first != nullptr) {
    addSentence(node.text, fmt::format("{} ends {}", first->name, bus::fromNow(*first->until)));
    if (endsSoon(*first)) {
      node.level = std::max(node.level, Level::kDegraded);
      addSentence(node.text, "`perdure security renew`, then restart the services");
    }
  }
  const std::uint64_t refused = refusals(seen);
  if (refused > 0) addSentence(node.text, fmt::format("strangers were refused {} times", refused));
  node.data = {{"identities", seen.host.identities.size()}, {"refused", refused}};
  return node;
}

StatusNode judgeHost(const StatusSeen& seen) {
  StatusNode node{"host"};
  for (const DiskSeen& disk : seen.host.disks) node.add(judgeDisk(disk));
  node.add(judgeClock(seen));
  if (seen.host.closed) node.add(judgeSecurity(seen));
  for (const TemperatureSeen& t : seen.host.temperatures) node.add(judgeTemperature(t));
  return node;
}

}  // namespace

void StatusNode::add(StatusNode child) {
  level = std::max(level, child.level);
  children.push_back(std::move(child));
}

StatusNode judge(const StatusSeen& seen) {
  StatusNode root{"perdure " + seen.vehicle};
  const Source source = sourceOf(seen);
  root.add(judgeServices(seen, source));
  root.add(judgeSensors(seen, source));
  root.add(judgeTopics(seen, source));
  if (isHeard(seen, "map_store")) root.add(judgeMap(seen));
  root.add(judgeHost(seen));
  if (seen.services.empty()) root.text = "no service is heard";
  return root;
}

}  // namespace perdure::tools
