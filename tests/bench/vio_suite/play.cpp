#include "tests/bench/vio_suite/play.h"

#include <algorithm>
#include <memory>

#include "common/replay/dataset.h"
#include "common/vision/image.h"
#include "services/vio/core/state/saved_state.h"
#include "services/vio/node.h"
#include "tests/bench/plain_tracker.h"

namespace perdure::bench {
namespace {

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// A vio node and its outputs.
class Player {
 public:
  Player(const Variant& variant, const Calibration& calibration, bool innovations)
      : node_(variant.config, 1, outputs(innovations)), camera_(calibration.cameras[0].name) {
    node_.onCalibration(calibration);
  }

  void take(const replay::Message& message) {
    const double begin = cpuMs();
    if (const auto* imu = std::get_if<ImuSample>(&message)) node_.onImu(*imu);
    if (const auto* speed = std::get_if<SpeedSample>(&message)) node_.onSpeed(*speed);
    const auto* frame = std::get_if<Frame>(&message);
    if (frame) {
      if (!first_frame_) first_frame_ = frame->stamp.time;
      node_.onFrame(*frame);
    }
    since_ += cpuMs() - begin;  // vio may process a frame at a later sample
    if (!frame || frame->camera != camera_) return;
    ms_.push_back(since_);
    since_ = 0.0;
  }

  Outcome outcome(const replay::PoseFile& truth, double time_offset_s) {
    node_.flush();
    Outcome out;
    out.frames = ms_.size();
    out.ms = quantile(ms_, 0.5);
    out.ms_p99 = quantile(ms_, 0.99);
    out.innovations = innovations_;
    for (const auto& [code, n] : node_.reasons().all()) out.reasons[code] = n;
    if (const auto state = vio::fromText(node_.saveState())) out.readout_s = state->readout_s[0];
    out.resets = out.reasons.count("reset") ? out.reasons["reset"] : 0;
    if (odometry_.empty()) return out;
    out.first_s = toSeconds(odometry_.front().stamp.time - *first_frame_);
    out.accuracy = accuracyOf(odometry_, truth, time_offset_s);
    return out;
  }

 private:
  vio::Outputs outputs(bool innovations) {
    vio::Outputs o{[this](const Odometry& odometry) {
                     if (odometry.state != OdometryState::kInitialising) {
                       odometry_.push_back(odometry);
                     }
                   },
                   [](const Landmarks&) {}};
    if (innovations) {
      o.innovations = [this](const std::vector<vio::Innovation>& i) { innovations_.add(i); };
    }
    return o;
  }

  vio::Node node_;
  std::string camera_;
  std::vector<Odometry> odometry_;
  std::vector<double> ms_;
  Innovations innovations_;
  double since_ = 0.0;
  std::optional<TimePoint> first_frame_;
};

}  // namespace

replay::PoseFile truthOf(const std::filesystem::path& folder, const replay::Dataset& dataset) {
  const auto tum = folder / "gt_tum.txt";
  if (std::filesystem::exists(tum)) return replay::PoseFile::read(tum);
  return dataset.truth().value();
}

std::vector<Outcome> play(const std::filesystem::path& folder, const std::vector<Variant>& variants,
                          const PlayOptions& options, const std::function<void(double)>& progress) {
  replay::DatasetOptions open;
  open.path = folder;
  open.encoding = open.second_encoding = ImageEncoding::kMono8;
  const auto dataset = replay::Dataset::open(open);
  Calibration calibration = dataset->calibration();
  for (CameraCalibration& camera : calibration.cameras) {
    camera.readout_s = options.readout_s.value_or(camera.readout_s);
  }
  std::vector<std::unique_ptr<Player>> players;
  for (const Variant& v : variants) {
    players.push_back(std::make_unique<Player>(v, calibration, options.innovations));
  }
  if (options.from_s > 0.0) dataset->skip(durationFromSeconds(options.from_s));
  const TimePoint end =
      *dataset->frameTime(0) + durationFromSeconds(std::min(options.until_s, 1e6));
  PlainTracker tracker;
  std::vector<double> klt;
  while (const auto message = dataset->next()) {
    for (const auto& player : players) player->take(*message);
    const auto* frame = std::get_if<Frame>(&*message);
    if (!frame || frame->camera != calibration.cameras[0].name) continue;
    if (frame->stamp.time > end) break;
    progress(static_cast<double>(frame->stamp.sequence + 1) /
             static_cast<double>(dataset->frameCount()));
    if (!options.klt) continue;
    const auto image = vision::monoOf(*frame);
    if (!image) continue;
    const double begin = cpuMs();
    tracker.follow(*image);
    klt.push_back(cpuMs() - begin);
  }
  const replay::PoseFile truth = truthOf(folder, *dataset);
  std::vector<Outcome> outcomes;
  for (const auto& player : players) {
    outcomes.push_back(player->outcome(truth, calibration.cameras[0].time_offset_s));
    outcomes.back().klt_ms = quantile(klt, 0.5);
    outcomes.back().klt_ms_p99 = quantile(klt, 0.99);
  }
  return outcomes;
}

}  // namespace perdure::bench
