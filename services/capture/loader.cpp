#include "services/capture/loader.h"

#include <algorithm>

#include "common/base/errors.h"
#include "common/replay/data_check.h"
#include "common/replay/recordings/ros_topics.h"
#include "common/vision/jpeg.h"

namespace perdure::capture {
namespace {

std::optional<ImageEncoding> encodingOf(const std::string& name) {
  if (name == "mono8") return ImageEncoding::kMono8;
  if (name == "bgr8") return ImageEncoding::kBgr8;
  return std::nullopt;
}

template <class Message>
auto& timeOf(Message& message) {
  return std::visit(
      [](auto& m) -> auto& {
        if constexpr (requires { m.stamp; }) {
          return m.stamp.time;
        } else {
          return m.time;
        }
      },
      message);
}

void requireImages(replay::Dataset& drive, const std::string& path) {
  for (auto message = drive.next(); message; message = drive.next()) {
    const auto* frame = std::get_if<Frame>(&*message);
    if (!frame) continue;
    if (!frame->data) break;
    return;
  }
  throw StartupError(ExitCode::kUnavailable,
                     path +
                         " has no readable images; capture needs a drive with images (a drive "
                         "without them runs in `perdure pipeline`).");
}

std::pair<TimePoint, TimePoint> spanOf(const replay::Dataset& drive) {
  TimePoint first = TimePoint::max(), last = TimePoint::min();
  for (std::uint64_t i = 0; i < drive.frameCount() && first == TimePoint::max(); ++i) {
    if (const auto time = drive.frameTime(i)) first = *time;
  }
  for (std::uint64_t i = drive.frameCount(); i > 0 && last == TimePoint::min(); --i) {
    if (const auto time = drive.frameTime(i - 1)) last = *time;
  }
  return {first, last};
}

}  // namespace

std::unique_ptr<replay::Dataset> openDrive(const Config& config, InstanceId source) {
  requireSource(config);
  replay::DatasetOptions options;
  options.path = config.dataset.path;
  options.sequence = config.dataset.sequence;
  options.rig = config.rig;
  options.topics = replay::topicsOf(config.dataset.topics);
  options.source = source;
  options.encoding = encodingOf(config.image.cam0);
  options.second_encoding = encodingOf(config.image.cam1);
  const auto looked_at = replay::Dataset::open(options);
  replay::refuseFatal(replay::checkData(looked_at->recording(), {}), config.dataset.path);
  requireImages(*looked_at, config.dataset.path);
  return replay::Dataset::open(options);
}

Loader::Loader(const Config& config, std::unique_ptr<replay::Dataset> drive, std::uint64_t first,
               std::function<void()> notify)
    : mono_(config.dataset.cameras == "mono"),
      quality_(config.image.compress == "jpeg" ? static_cast<int>(config.image.quality) : 0),
      repeats_(config.run.on_end == "repeat"),
      drive_(std::move(drive)),
      frame_count_(drive_->frameCount()),
      notify_(std::move(notify)) {
  const auto [begin, end] = spanOf(*drive_);
  begin_ = begin;
  from_ = begin - durationFromSeconds(config.dataset.lead_s);
  until_ = end + durationFromSeconds(config.dataset.trail_s) + Duration{1};
  if (repeats_) {
    const auto pauses = static_cast<Duration::rep>(std::max<std::uint64_t>(frame_count_, 2) - 1);
    length_ = end - begin + (end - begin) / pauses;
    until_ = begin + length_;
    // Starts at the previous frame, because samples after the last frame of a lap belong to that
    // lap.
    first -= std::min<std::uint64_t>(first, 1);
    lap_ = first / frame_count_;
    first %= frame_count_;
  }
  drive_->seek(first);
  thread_ = std::thread([this] { run(); });
}

Loader::~Loader() {
  queue_.close();
  thread_.join();
}

bool Loader::isOver(const std::optional<replay::Message>& message) const {
  return !message || timeOf(*message) >= until_;
}

bool Loader::isWanted(const replay::Message& message) const {
  const auto* frame = std::get_if<Frame>(&message);
  if (frame) return !mono_ || frame->camera == "cam0";
  return timeOf(message) >= (lap_ == 0 ? from_ : begin_);
}

void Loader::moveToLap(replay::Message& message) const {
  timeOf(message) += static_cast<Duration::rep>(lap_) * length_;
  if (auto* frame = std::get_if<Frame>(&message)) frame->stamp.sequence += lap_ * frame_count_;
}

/// Compresses a frame. If this fails, the frame stays uncompressed, and the failure is counted.
void Loader::compress(replay::Message& message) {
  auto* frame = std::get_if<Frame>(&message);
  if (!frame || !frame->data) return;
  auto small = vision::compressed(*frame, quality_);
  if (small) {
    *frame = *std::move(small);
    return;
  }
  const std::lock_guard lock(mutex_);
  uncompressed_.add(small.error());
}

void Loader::run() {
  bool open = true;
  while (open) {
    auto message = drive_->next();
    {
      const std::lock_guard lock(mutex_);
      reasons_ = drive_->reasons();
      last_problem_ = drive_->lastProblem();
    }
    if (isOver(message)) {
      if (!repeats_) break;
      ++lap_;
      drive_->seek(0);
      continue;
    }
    if (!isWanted(*message)) continue;
    moveToLap(*message);
    if (quality_ > 0) compress(*message);
    open = queue_.push(*std::move(message));
    notify_();
  }
  finish();
}

void Loader::finish() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  notify_();
}

std::optional<replay::Message> Loader::take() { return queue_.tryPop(); }

bool Loader::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

ReasonCounts Loader::reasons() const {
  const std::lock_guard lock(mutex_);
  ReasonCounts all = reasons_;
  all.add(uncompressed_);
  return all;
}

std::string Loader::lastProblem() const {
  const std::lock_guard lock(mutex_);
  return last_problem_;
}

}  // namespace perdure::capture
