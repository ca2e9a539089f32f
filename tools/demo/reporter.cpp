#include "tools/demo/reporter.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/bus/topics.h"
#include "common/types/health.h"
#include "tools/outputs/stage_timer.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::ordered_json;

double rounded(double value) { return std::round(value * 1000.0) / 1000.0; }

nlohmann::ordered_json quantilesOf(const std::vector<double>& values) {
  const auto rounded = [&](double q) { return std::round(1000.0 * quantile(values, q)) / 1000.0; };
  return {{"median", rounded(0.5)}, {"p99", rounded(0.99)}};
}

}  // namespace

std::int64_t monotonicNs() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void ServiceCounts::add(const Health& health) {
  Process& process =
      by_instance_.try_emplace(health.instance, Process{{}, in_, out_, dropped_}).first->second;
  process.health = health;
  in_ = std::max(in_, process.in + health.frames_in);
  out_ = std::max(out_, process.out + health.frames_out);
  dropped_ = std::max(dropped_, process.dropped + health.dropped);
}

double ServiceCounts::cpuSeconds() const {
  double total = 0.0;
  for (const auto& [instance, process] : by_instance_) total += process.health.cpu_s;
  return total;
}

std::map<std::string, std::uint64_t> ServiceCounts::reasons() const {
  std::map<std::string, std::uint64_t> total;
  for (const auto& [instance, process] : by_instance_) {
    for (const auto& [reason, count] : process.health.reasons) total[reason] += count;
  }
  return total;
}

std::vector<pid_t> ServiceCounts::pids() const {
  std::vector<pid_t> all;
  for (const auto& [instance, process] : by_instance_) {
    all.push_back(static_cast<pid_t>(process.health.pid));
  }
  return all;
}

Reporter::Reporter(const bus::Participant& participant, bus::WaitLoop& loop, OutputWriter& outputs,
                   std::map<std::string, ShapePoints> shapes)
    : outputs_(outputs),
      shapes_(std::move(shapes)),
      calibration_reader_(participant, bus::kTopic<Calibration>),
      odometry_reader_(participant, bus::kTopic<Odometry>),
      landmarks_reader_(participant, bus::kTopic<Landmarks>),
      model_reader_(participant, bus::kTopic<ModelInfo>),
      detections_reader_(participant, bus::kTopic<Detections>),
      objects_reader_(participant, bus::kTopic<Objects>),
      events_reader_(participant, bus::kTopic<Event>),
      health_reader_(participant, bus::kTopic<Health>) {
  loop.on(calibration_reader_, [this](const Calibration& c) { outputs_.onCalibration(c); });
  loop.on(odometry_reader_, [this](const Odometry& o) { onOdometry(o); });
  loop.on(landmarks_reader_, [this](const Landmarks& l) { outputs_.onLandmarks(l); });
  loop.on(model_reader_, [this](const ModelInfo& m) { onModel(m); });
  loop.on(detections_reader_, [this](const Detections& d) {
    if (detections_.insert(d.stamp.sequence).second) {
      boxes_ += d.detections.size();
      outputs_.onDetections(d);
    }
    latency_.onDetections(d);
    last_message_ns_ = monotonicNs();
  });
  loop.on(objects_reader_, [this](const Objects& o) { onObjects(o); });
  loop.on(events_reader_, [this](const Event& e) { outputs_.onEvent(e); });
  loop.on(health_reader_, [this](const Health& h) { onHealth(h); });
}

void Reporter::onOdometry(const Odometry& odometry) {
  if (odometry_.empty()) first_time_ = odometry.stamp.time;
  odometry_.insert(odometry.stamp.sequence);
  newest_frame_ = std::max(newest_frame_, odometry.stamp.sequence);
  newest_time_ = std::max(newest_time_, odometry.stamp.time);
  last_message_ns_ = monotonicNs();
  outputs_.onOdometry(odometry);
}

void Reporter::onObjects(const Objects& objects) {
  last_message_ns_ = monotonicNs();
  latency_.onObjects(objects, last_message_ns_);
  outputs_.onObjects(objects);
  objects_.insert(objects.stamp.sequence);
}

void Reporter::onModel(const ModelInfo& model) {
  if (model.boxes == BoxExtent::kOutline) outputs_.setShapes(shapes_);
}

void Reporter::onHealth(const Health& health) {
  if (health.instance == 0) return;
  const auto before = newest_health_.find(health.process);
  if (before != newest_health_.end() && before->second.instance == health.instance) {
    const std::uint64_t frames = health.frames_out - before->second.frames_out;
    const double cpu_ms = 1000.0 * (health.cpu_s - before->second.cpu_s);
    if (frames > 0) spans_[health.process].push_back({frames, cpu_ms});
  }
  newest_health_[health.process] = health;
  services_[health.process].add(health);
}

const Health* Reporter::healthOf(const std::string& process) const {
  const auto found = newest_health_.find(process);
  return found == newest_health_.end() ? nullptr : &found->second;
}

std::vector<pid_t> Reporter::pidsOf(const std::string& process) const {
  const auto found = services_.find(process);
  return found == services_.end() ? std::vector<pid_t>() : found->second.pids();
}

bool Reporter::drained() const {
  const Health* capture = healthOf("capture");
  if (capture == nullptr || capture->message != kEndOfDrive) return false;
  return std::ranges::includes(objects_, odometry_);
}

std::string Reporter::progressLine(std::size_t frames_in_all) const {
  const Health* capture = healthOf("capture");
  if (odometry_.empty()) {
    const std::string what = capture == nullptr ? "starting" : capture->message;
    return what.empty() ? "running, no odometry yet" : what;
  }
  const Health* vio = healthOf("vio");
  const Health* inference = healthOf("inference");
  return fmt::format(
      "frame {}/{}  odometry {:.1f} Hz  detections {:.1f} Hz  objects {}  latency {:.0f} ms",
      newest_frame_ + 1, frames_in_all, vio == nullptr ? 0.0 : vio->rate_hz,
      inference == nullptr ? 0.0 : inference->rate_hz, outputs_.history().confirmedNow(),
      latency_.last_ms());
}

Json Reporter::report() const {
  Json services = Json::object();
  for (const auto& [name, counts] : services_) {
    services[name] = {{"frames_in", counts.framesIn()},        {"frames_out", counts.framesOut()},
                      {"dropped", counts.dropped()},           {"restarts", 0},
                      {"cpu_s", rounded(counts.cpuSeconds())}, {"reasons", counts.reasons()}};
  }
  Json all = {{"services", services},
              {"messages",
               {{"odometry", odometry_.size()},
                {"detections", detections_.size()},
                {"objects", objects_.size()}}}};
  all.update(latency_.report());
  return all;
}

RunFacts Reporter::facts(const replay::DataFindings& before) const {
  RunFacts facts{.frames = odometry_.size(),
                 .boxes = boxes_,
                 .objects = outputs_.history().lastBeliefs().size(),
                 .findings = before};
  for (const auto& [name, counts] : {std::pair("vio", &facts.vio), {"capture", &facts.capture}}) {
    const auto service = services_.find(name);
    if (service == services_.end()) continue;
    for (const auto& [code, times] : service->second.reasons()) counts->add(code, times);
  }
  return facts;
}

Json Reporter::timing() const {
  Json stages = Json::object();
  for (const auto& [name, spans] : spans_) {
    std::uint64_t calls = 0;
    double total = 0.0;
    std::vector<double> each;
    for (const Span& span : spans) {
      calls += span.frames;
      total += span.cpu_ms;
      each.push_back(span.cpu_ms / static_cast<double>(span.frames));
    }
    stages[name] = {{"calls", calls},
                    {"cpu_ms",
                     {{"median", rounded(quantile(each, 0.5))},
                      {"p99", rounded(quantile(each, 0.99))},
                      {"total", rounded(total)}}}};
  }
  return {{"stages", stages}, {"of", "means a frame over each second, from Health"}};
}

void LatencyMeter::onObjects(const Objects& objects, std::int64_t now_ns) {
  Frame& frame = frames_[objects.stamp.sequence];
  if (frame.age_ms >= 0.0) return;
  frame.age_ms = static_cast<double>(now_ns - objects.stamp.captured_ns) * 1e-6;
  last_ms_ = frame.age_ms;
}

void LatencyMeter::onDetections(const Detections& detections) {
  if (!(detections.forward_s > 0.0)) return;
  Frame& frame = frames_[detections.stamp.sequence];
  if (frame.forward_ms < 0.0) frame.forward_ms = 1e3 * detections.forward_s;
}

nlohmann::ordered_json LatencyMeter::report() const {
  std::vector<double> whole, beyond;
  for (const auto& [sequence, frame] : frames_) {
    if (frame.age_ms < 0.0) continue;
    whole.push_back(frame.age_ms);
    // Objects that are younger than the network's time were published without its detections.
    if (frame.forward_ms < 0.0 || frame.age_ms < frame.forward_ms) continue;
    beyond.push_back(frame.age_ms - frame.forward_ms);
  }
  return {{"latency_ms", quantilesOf(whole)}, {"latency_beyond_network_ms", quantilesOf(beyond)}};
}

}  // namespace perdure::tools
