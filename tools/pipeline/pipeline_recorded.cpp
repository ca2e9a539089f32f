// Runs the filter on recorded odometry and detections. The filter receives the messages that
// `perdure play` sends to the service, in the same order.
#include "common/base/errors.h"
#include "common/bus/topics.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

constexpr char kRecorded[] = "recorded";

/// Whether a topic is an input of semantic_filter. The recorded answers of the map store are not
/// used, because the run's own map answers.
bool isFiltersInput(const std::string& topic) {
  return topic.starts_with("calibration") || topic == "model" || topic == "inference/swap" ||
         topic == "odometry" || topic == "landmarks" || topic == "detections";
}

/// Returns the time of a message; the epoch if it has none.
template <class T>
TimePoint timeOf(const T& message) {
  if constexpr (requires { message.stamp.time; }) return message.stamp.time;
  return TimePoint();
}

}  // namespace

void Pipeline::checkRecorded() {
  const bool odometry = options_.odometry == kRecorded,
             detections = options_.detections == kRecorded;
  recorded_ = odometry && detections;
  if (recorded_ && (options_.from > 0.0 || options_.every > 1)) {
    throw StartupError(
        ExitCode::kUsage,
        "--from and --every leave out data, and recorded odometry and detections are given as "
        "the filter heard them; give --seconds alone");
  }
  if (odometry != detections) {
    throw StartupError(ExitCode::kUsage,
                       "recorded odometry and recorded detections go together, as the filter heard "
                       "them; give both, or neither: vio and model run again on recorded images");
  }
  if (recorded_ && !replay::RecordedMessages::looksLikeOne(options_.data)) {
    throw StartupError(ExitCode::kUsage,
                       options_.data + " is no recording; `perdure record` makes one");
  }
}

void Pipeline::runRecorded(const std::function<void(const PipelineCounts&)>& progress) {
  replay::RecordedMessages messages(options_.data);
  messages.rewind(isFiltersInput);
  heard_frames_.emplace();
  while (const auto message = timer_.timeTowardsNext("decode", [&] { return messages.next(); })) {
    const std::uint64_t frames = counts_.frames;
    handleRecorded(*message);
    remember();
    if (counts_.frames == frames) continue;
    for (const char* stage : {"decode", "semantic_filter", "map_store", "outputs"}) {
      timer_.time(stage, [] {});
    }
    progress(counts_);
    if (options_.seconds && frames_seconds_ > *options_.seconds) break;
  }
  for (const auto& [reason, n] : messages.reasons().all()) reasons_.add(reason, n);
  timer_.timeTowardsNext("semantic_filter", [&] { filter_->flush(); });
  timer_.time("map_store", [&] { map_->finish(); });
}

void Pipeline::handleRecorded(const replay::RecordedMessage& message) {
  const auto give = [&]<class T>(const T&, auto use) {
    const auto value = replay::valueOf<T>(message);
    if (!value) return reasons_.add(message.topic + "_" + value.error().code);
    keep(message.topic, *value, timeOf(*value));
    use(*value);
  };
  const auto filter = [&](auto work) { timer_.timeTowardsNext("semantic_filter", work); };
  if (message.topic.starts_with("calibration")) {
    give(Calibration(), [&](const Calibration& m) {
      filter([&] { filter_->onCalibration(m); });
      const bool estimated = message.topic == bus::kEstimatedCalibration.name;
      if (estimated && !m.cameras.empty()) outputs_->onEstimatedCamera(m.cameras.front());
    });
  } else if (message.topic == "model") {
    give(ModelInfo(), [&](const auto& m) { filter([&] { hear(m); }); });
  } else if (message.topic == "inference/swap") {
    give(SwapNotice(), [&](const auto& m) { filter([&] { filter_->onSwap(m); }); });
  } else if (message.topic == "odometry") {
    give(Odometry(), [&](const Odometry& m) {
      if (!odometry_once_.first(m.stamp.source, m.stamp.sequence)) return;
      if (!first_frame_) first_frame_ = m.stamp.time;
      frames_seconds_ = toSeconds(m.stamp.time - *first_frame_);
      ++counts_.frames;
      heard_frames_->insert(m.stamp.sequence);
      if (m.state != OdometryState::kInitialising) ++counts_.odometry;
      outputs_->onOdometry(m);
      timer_.timeTowardsNext("map_store", [&] { map_->onOdometry(m); });
      filter([&] { filter_->onOdometry(m); });
    });
  } else if (message.topic == "landmarks") {
    give(Landmarks(), [&](const Landmarks& m) {
      outputs_->onLandmarks(m);
      timer_.timeTowardsNext("map_store", [&] { map_->onLandmarks(m); });
      filter([&] { filter_->onLandmarks(m); });
    });
  } else {
    give(Detections(), [&](const Detections& m) {
      outputs_->onDetections(m);
      ++counts_.inferred;
      heard_frames_->insert(m.stamp.sequence);
      counts_.detections += m.detections.size();
      filter([&] { filter_->onDetections(m); });
    });
  }
}

}  // namespace perdure::tools
