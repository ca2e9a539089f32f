#include "tests/process/soak_run.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <regex>

#include "common/math/so3.h"
#include "tools/demo/embedded_drive.h"
#include "tools/demo/reporter.h"
#include "tools/outputs/pictures/chart.h"
#include "tools/simulate/simulate.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr char kName[] = "soak";

/// Returns the number of frames.
std::size_t renderLap(const fs::path& folder) {
  tools::SimulateOptions options = tools::embeddedScene();
  options.scene = "lap";
  options.world.seconds.reset();
  options.out = folder;
  tools::simulate(options, [](const tools::SimulateProgress&) {});
  std::ifstream list(folder / "mav0/cam0/data.csv");
  std::size_t lines = 0;
  for (std::string line; std::getline(list, line);) ++lines;
  return lines - 1;  // the header line
}

/// Replaces numbers and hexadecimal ids, which differ between repetitions of a message.
std::string withoutNumbers(const std::string& text) {
  static const std::regex number("\\b[0-9a-f]{8,}\\b|[0-9]+(\\.[0-9]+)?");
  return std::regex_replace(text, number, "#");
}

}  // namespace

SoakRun::SoakRun(fs::path folder, int shared_memory_mb)
    : folder_(std::move(folder)),
      shared_memory_mb_(shared_memory_mb),
      domain_(ownNetwork()),
      participant_(domain_, kName),
      calibration_reader_(participant_, bus::kTopic<Calibration>),
      odometry_reader_(participant_, bus::kTopic<Odometry>),
      detections_reader_(participant_, bus::kTopic<Detections>),
      objects_reader_(participant_, bus::kTopic<Objects>),
      header_reader_(participant_, bus::kTopic<MapHeader>),
      health_reader_(participant_, bus::kTopic<Health>),
      loop_(participant_) {
  fs::create_directories(folder_);
  frames_a_lap_ = renderLap(folder_ / "lap");
}

void SoakRun::start() {
  tools::DemoOptions options;
  options.data = (folder_ / "lap").string();
  options.root = sources().string();
  options.programs = programs().string();
  options.model = tools::embeddedModel(sources());
  options.out = (folder_ / "out").string();
  options.shared_memory_mb = shared_memory_mb_;
  plans_ = tools::planServices(options, tools::prepareFolders(options));
  for (tools::ServicePlan& plan : plans_) {
    if (plan.name == "capture") {
      for (const std::string& setting :
           {std::string("run.on_end=repeat"),
            fmt::format("start.readers=[vio, inference, semantic_filter, map_store, {}]", kName)}) {
        plan.command.insert(plan.command.end(), {"--set", setting});
      }
    }
    children_[plan.name] = std::make_unique<Child>(plan.command, plan.log);
  }
}

void SoakRun::listen() {
  loop_.on(calibration_reader_, [](const Calibration&) {});
  loop_.on(odometry_reader_, [this](const Odometry& o) {
    if (begun_ns_ == 0) begun_ns_ = tools::monotonicNs();
    odometry_.insert(o.stamp.sequence);
    if (o.stamp.sequence % frames_a_lap_ == 0) T_WB_[o.stamp.sequence / frames_a_lap_] = o.T_WB;
  });
  loop_.on(detections_reader_, [this](const Detections& d) {
    detections_.insert(d.stamp.sequence);
    latency_.onDetections(d);
  });
  loop_.on(objects_reader_, [this](const Objects& o) {
    latency_.onObjects(o, tools::monotonicNs());
    objects_.insert(o.stamp.sequence);
    const std::size_t lap = o.stamp.sequence / frames_a_lap_;
    if (confirmed_.size() <= lap) confirmed_.resize(lap + 1);
    now_.held = o.objects.size();
    now_.confirmed = 0;
    for (const ObjectBelief& object : o.objects) {
      if (!object.confirmed) continue;
      ++now_.confirmed;
      confirmed_[lap].insert(object.id);
    }
  });
  loop_.on(header_reader_, [this](const MapHeader& h) { now_.on_map = h.objects; });
  loop_.on(health_reader_, [this](const Health& h) {
    health_[h.process] = h;
    now_.memory_mb[h.process] = static_cast<double>(h.rss_bytes) / 1e6;
  });
  loop_.every(1s, [this] { note(); });
}

double SoakRun::seconds() const {
  return begun_ns_ == 0 ? 0.0 : 1e-9 * static_cast<double>(tools::monotonicNs() - begun_ns_);
}

void SoakRun::note() {
  if (begun_ns_ == 0) return;
  now_.s = seconds();
  points_.push_back(now_);
  if (points_.size() % 60 != 0) return;
  std::string memory;
  for (const auto& [service, mb] : now_.memory_mb) {
    memory += fmt::format("  {} {:.1f}", service, mb);
  }
  const Frames counts = frames();
  const Walk last = T_WB_.empty() ? Walk{} : walk().back();
  std::cout << fmt::format(
                   "{:>3} min  lap {}  frames {} (without odometry {}, detections {}, objects {})  "
                   "held {}  confirmed {}  on the map {}  walked {:.2f} m {:.2f} deg  MB:{}",
                   points_.size() / 60, confirmed_.size(), counts.given, counts.without_odometry,
                   counts.without_detections, counts.without_objects, now_.held, now_.confirmed,
                   now_.on_map, last.m, last.deg, memory)
            << std::endl;
}

bool SoakRun::allLive() {
  bool all = true;
  for (const auto& [name, child] : children_) {
    const int status = child->wait(0ms);
    if (status == -1) continue;
    std::cerr << name << " ended with " << status << ":\n" << child->log();
    all = false;
  }
  return all;
}

void SoakRun::end() {
  for (const tools::ServicePlan& plan : plans_) {
    children_[plan.name]->signal(SIGTERM);
    (void)children_[plan.name]->wait(5s);
  }
}

bool SoakRun::run(double duration) {
  start();
  listen();
  const bool begun = eventually(90s, [&] {
    loop_.runOnce(20ms);
    return begun_ns_ != 0 || !allLive();
  });
  bool live = begun && begun_ns_ != 0;
  for (std::size_t turn = 0; live && seconds() < duration; ++turn) {
    loop_.runOnce(50ms);
    if (turn % 64 == 0) live = allLive();
  }
  end();
  return live;
}

SoakRun::Frames SoakRun::frames() const {
  Frames counts;
  if (objects_.empty()) return counts;
  constexpr std::uint64_t kSecond = 20;
  const std::uint64_t first = *objects_.begin(), last = *objects_.rbegin();
  for (std::uint64_t i = first; i + kSecond <= last; ++i) {
    ++counts.given;
    counts.without_odometry += !odometry_.contains(i);
    counts.without_detections += !detections_.contains(i);
    counts.without_objects += !objects_.contains(i);
  }
  return counts;
}

std::vector<Complaint> SoakRun::complaints() const {
  static const std::regex usual("^\\S+ (\\d+):(\\d+):\\S+ \\S+ (trace|debug|info): .*");
  static const std::regex stamped("^\\S+ (\\d+):(\\d+):\\S+ \\S+ (\\S+: .*)");
  std::map<std::pair<std::string, std::string>, std::map<std::string, std::size_t>> by_minute;
  for (const tools::ServicePlan& plan : plans_) {
    std::ifstream log(plan.log);
    for (std::string line; std::getline(log, line);) {
      if (std::regex_match(line, usual)) continue;
      std::smatch parts;
      const bool has_time = std::regex_match(line, parts, stamped);
      const std::string text = withoutNumbers(has_time ? parts[3].str() : line);
      ++by_minute[{plan.name, text}][has_time ? parts[1].str() + parts[2].str() : ""];
    }
  }
  std::vector<Complaint> all;
  for (const auto& [what, minutes] : by_minute) {
    Complaint complaint{what.first, what.second};
    for (const auto& [minute, n] : minutes) {
      complaint.count += n;
      complaint.most_in_a_minute = std::max(complaint.most_in_a_minute, n);
    }
    all.push_back(complaint);
  }
  return all;
}

std::set<ObjectId> SoakRun::confirmedIn(std::size_t lap) const {
  return lap < confirmed_.size() ? confirmed_[lap] : std::set<ObjectId>{};
}

double SoakRun::growth_mb(const std::string& service, double from_s, double to_s) const {
  const auto around = [&](double end) {
    std::vector<double> values;
    for (const SoakPoint& point : points_) {
      const auto it = point.memory_mb.find(service);
      if (point.s > end - 60.0 && point.s <= end && it != point.memory_mb.end())
        values.push_back(it->second);
    }
    if (values.empty()) return std::nan("");
    std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2),
                     values.end());
    return values[values.size() / 2];
  };
  return around(to_s) - around(from_s);
}

std::vector<SoakRun::Walk> SoakRun::walk() const {
  std::vector<Walk> walk;
  for (const auto& [lap, T_WB] : T_WB_) {
    const RigidTransform& first = T_WB_.begin()->second;
    const Eigen::Vector3d step = T_WB.p - first.p;
    const double yaw = yawOf(Eigen::Matrix3d(T_WB.R() * first.R().transpose()));
    walk.push_back({lap, step.norm(), step.z(), yaw * 180.0 / std::numbers::pi});
  }
  return walk;
}

std::size_t SoakRun::mostHeld(double until_s) const {
  std::size_t most = 0;
  for (const SoakPoint& point : points_) {
    if (point.s <= until_s) most = std::max(most, point.held);
  }
  return most;
}

nlohmann::ordered_json SoakRun::report() const {
  const Frames counts = frames();
  nlohmann::ordered_json json = {{"seconds", points_.empty() ? 0.0 : points_.back().s},
                                 {"laps", confirmed_.size()},
                                 {"frames", counts.given},
                                 {"without_odometry", counts.without_odometry},
                                 {"without_detections", counts.without_detections},
                                 {"without_objects", counts.without_objects},
                                 {"most_held", mostHeld(seconds())}};
  json.update(latency_.report());
  json["walk"] = nlohmann::ordered_json::array();
  for (const Walk& w : walk()) {
    json["walk"].push_back({{"lap", w.lap}, {"m", w.m}, {"up_m", w.up_m}, {"deg", w.deg}});
  }
  for (const auto& [name, h] : health_) {
    json["services"][name] = {{"frames_in", h.frames_in},
                              {"frames_out", h.frames_out},
                              {"dropped", h.dropped},
                              {"cpu_s", h.cpu_s},
                              {"memory_mb", static_cast<double>(h.rss_bytes) / 1e6},
                              {"reasons", h.reasons}};
  }
  json["complaints"] = nlohmann::ordered_json::array();
  for (const Complaint& c : complaints()) {
    json["complaints"].push_back({{"service", c.service},
                                  {"text", c.text},
                                  {"count", c.count},
                                  {"most_in_a_minute", c.most_in_a_minute}});
  }
  return json;
}

void SoakRun::draw(const fs::path& file) const {
  if (points_.empty()) return;
  constexpr int kWidth = 1200, kRow = 260, kLeft = 80, kRight = 200, kGap = 50;
  cv::Mat picture(2 * (kRow + kGap) + 30, kWidth, CV_8UC3, tools::kPaper);
  const double minutes = points_.back().s / 60.0;
  const auto chart = [&](int row, const std::string& title,
                         const std::map<std::string, std::vector<cv::Point2d>>& curves) {
    double top = 1.0;
    for (const auto& [name, points] : curves)
      for (const cv::Point2d& p : points) top = std::max(top, 1.1 * p.y);
    const int y = 40 + row * (kRow + kGap);
    tools::Chart plot(picture, {kLeft, y, kWidth - kLeft - kRight, kRow}, {0.0, minutes},
                      {0.0, top});
    plot.drawGrid(true);
    tools::drawText(picture, title, {kLeft, y - 12}, tools::kInk);
    int line = 0;
    for (const auto& [name, points] : curves) {
      static const tools::Colour kColours[] = {
          {160, 90, 0}, {0, 130, 0}, {0, 0, 190}, {180, 0, 160}, {0, 130, 200}};
      const tools::Colour colour = kColours[static_cast<std::size_t>(line) % 5];
      plot.drawCurve(points, {colour, 2});
      tools::drawText(picture, fmt::format("{} {:.0f}", name, points.back().y),
                      {kWidth - kRight + 14, y + 20 + 22 * line++}, colour);
    }
  };
  std::map<std::string, std::vector<cv::Point2d>> memory, objects;
  for (const SoakPoint& point : points_) {
    const double at = point.s / 60.0;
    for (const auto& [service, mb] : point.memory_mb) memory[service].emplace_back(at, mb);
    objects["held"].emplace_back(at, static_cast<double>(point.held));
    objects["confirmed of them"].emplace_back(at, static_cast<double>(point.confirmed));
    objects["on the map"].emplace_back(at, static_cast<double>(point.on_map));
  }
  chart(0, "resident memory, MB, over minutes", memory);
  chart(1, "objects, over minutes", objects);
  cv::imwrite(file.string(), picture);
}

}  // namespace perdure::test
