#include "services/gateway/core/vital_signs.h"

#include <fmt/format.h>

#include <functional>

#include "common/types/health.h"
#include "services/gateway/core/json_writer.h"

namespace perdure::gateway {
namespace {

constexpr double kSilent = 2.5;  // s; services send Health once a second

double secondsSince(std::int64_t then_ns, std::int64_t now_ns) {
  return then_ns == 0 ? -1.0 : 1e-9 * static_cast<double>(now_ns - then_ns);
}

/// Returns the value of a label, escaped for Prometheus.
std::string label(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\' || c == '"') escaped += '\\';
    if (c == '\n') {
      escaped += "\\n";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

}  // namespace

void VitalSigns::onHealth(const Health& health, std::int64_t now_ns) {
  constexpr std::size_t kMostServices = 64;
  if (!services_.contains(health.process) && services_.size() >= kMostServices) return;
  Service& service = services_[health.process];
  const double span = secondsSince(service.heard_ns, now_ns);
  const bool same = service.health.instance == health.instance && span > 0.2;
  service.cpu = same ? (health.cpu_s - service.health.cpu_s) / span : -1.0;
  service.health = health;
  service.heard_ns = now_ns;
}

bool VitalSigns::hears(const std::string& process, std::int64_t now_ns) const {
  const auto found = services_.find(process);
  return found != services_.end() && secondsSince(found->second.heard_ns, now_ns) <= kSilent;
}

Health VitalSigns::shown(const Health& health, std::int64_t now_ns) const {
  Health result = health;
  const bool heard = hears("capture", now_ns);
  if (endedWith(heard ? &services_.at("capture").health : nullptr, health)) {
    result.state = HealthState::kOk;
    result.message = std::string("nothing more comes: ") + kEndOfDrive;
  }
  return result;
}

void VitalSigns::setStandIns(std::map<std::string, std::string> sentences) {
  stand_ins_ = std::move(sentences);
}

std::string VitalSigns::json(std::int64_t now_ns, const Silence& last) const {
  JsonWriter json(4096);
  json.begin('{').with("vehicle", vehicle_).key("services").begin('[');
  for (const auto& [name, sentence] : stand_ins_) {
    json.begin('{').with("process", name).with("state", "ok").with("stood_in_for", true);
    json.with("message", sentence).end('}');
  }
  for (const auto& [name, service] : services_) {
    if (stand_ins_.contains(name)) continue;
    const Health h = shown(service.health, now_ns);
    json.begin('{').with("process", name).with("state", nameOf(h.state)).with("message", h.message);
    json.with("age_s", secondsSince(service.heard_ns, now_ns), 2).with("frames_in", h.frames_in);
    json.with("frames_out", h.frames_out).with("dropped", h.dropped).with("rate_hz", h.rate_hz, 2);
    json.with("cpu", service.cpu, 3).with("rss_mb", 1e-6 * static_cast<double>(h.rss_bytes), 1);
    json.key("reasons").begin('{');
    for (const auto& [reason, n] : h.reasons) json.textKey(reason).integer(n);
    json.end('}').end('}');
  }
  json.end(']').key("silent_s").begin('{');
  json.with("objects", secondsSince(last.objects_ns, now_ns), 2);
  return json.with("odometry", secondsSince(last.odometry_ns, now_ns), 2).end('}').end('}').take();
}

std::string VitalSigns::healthz(std::int64_t now_ns) const {
  const char* status = "ok";
  std::size_t heard = 0;
  JsonWriter services;
  services.begin('{');
  for (const auto& [name, service] : services_) {
    if (stand_ins_.contains(name)) continue;
    const bool silent = secondsSince(service.heard_ns, now_ns) > kSilent;
    if (name != "gateway" && !silent) ++heard;
    const HealthState state = shown(service.health, now_ns).state;
    if (silent || state != HealthState::kOk) status = "degraded";
    services.textKey(name).text(silent ? "silent" : nameOf(state));
  }
  for (const auto& [name, sentence] : stand_ins_) services.textKey(name).text("stood_in_for");
  services.end('}');
  JsonWriter json;
  json.begin('{').with("status", heard == 0 ? "silent" : status);
  return json.key("services").raw(services.str()).end('}').take() + "\n";
}

std::string VitalSigns::metrics(std::int64_t now_ns, const std::vector<Figure>& own,
                                const std::map<std::string, std::uint64_t>& own_reasons) const {
  std::string text;
  const auto head = [&](const std::string& name, const std::string& help, const char* type) {
    text += fmt::format("# HELP perdure_{0} {1}\n# TYPE perdure_{0} {2}\n", name, help, type);
  };
  const auto each = [&](const std::string& name, const std::string& help, const char* type,
                        const std::function<double(const Service&)>& value) {
    head(name, help, type);
    for (const auto& [process, service] : services_) {
      text +=
          fmt::format("perdure_{}{{process=\"{}\"}} {}\n", name, label(process), value(service));
    }
  };
  each("service_up", "1 where the service was heard in the last seconds", "gauge",
       [&](const Service& s) { return secondsSince(s.heard_ns, now_ns) <= kSilent ? 1 : 0; });
  each("service_state", "0 starting, 1 ok, 2 degraded, 3 failed", "gauge",
       [&](const Service& s) { return static_cast<double>(shown(s.health, now_ns).state); });
  each("frames_in_total", "frames that the service took", "counter",
       [](const Service& s) { return static_cast<double>(s.health.frames_in); });
  each("frames_out_total", "results that it gave", "counter",
       [](const Service& s) { return static_cast<double>(s.health.frames_out); });
  each("dropped_total", "frames that it left out", "counter",
       [](const Service& s) { return static_cast<double>(s.health.dropped); });
  each("cpu_seconds_total", "processor time of all threads", "counter",
       [](const Service& s) { return s.health.cpu_s; });
  each("resident_bytes", "memory", "gauge",
       [](const Service& s) { return static_cast<double>(s.health.rss_bytes); });
  head("reasons_total", "what was counted, by reason", "counter");
  for (const auto& [process, service] : services_) {
    for (const auto& [reason, n] : service.health.reasons) {
      text += fmt::format("perdure_reasons_total{{process=\"{}\",reason=\"{}\"}} {}\n",
                          label(process), label(reason), n);
    }
  }
  for (const Figure& figure : own) {
    head("gateway_" + figure.name, figure.help, figure.counts ? "counter" : "gauge");
    text += fmt::format("perdure_gateway_{} {}\n", figure.name, figure.value);
  }
  head("gateway_refused_total", "connections and messages that were refused or cut", "counter");
  for (const auto& [reason, n] : own_reasons) {
    text += fmt::format("perdure_gateway_refused_total{{reason=\"{}\"}} {}\n", label(reason), n);
  }
  return text;
}

}  // namespace perdure::gateway
