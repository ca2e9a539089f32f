// Starts of the node's filter: from a saved state, at rest, with speed, or in motion.
#include <algorithm>
#include <cmath>

#include "services/vio/core/start/initialiser.h"
#include "services/vio/node.h"

namespace perdure::vio {

bool Node::resume(TimePoint now) {
  if (!saved_) return false;
  SavedState saved = *std::exchange(saved_, std::nullopt);
  const double age = toSeconds(now - saved.time);
  if (age < 0.0 || age > config_.restore_age_s || imu_.empty()) {
    reasons_.add("state_too_old");
    world_.epoch = saved.world.epoch + 1;
    return false;
  }
  if (const auto fits = cameras_->estimator.fits(saved); !fits) {
    reasons_.add(fits.error());
    world_.epoch = saved.world.epoch + 1;
    return false;
  }
  const double gap = toSeconds(std::min(imu_.first(), now) - saved.time);
  coast(saved, gap);
  cameras_->estimator.restore(saved);
  cameras_->tracker.continueIdsFrom(saved.next_track);
  degraded_frames_ = kDegradedFrames;
  reasons_.add("state_resumed");
  return true;
}

std::size_t Node::framesIn(double seconds) const {
  const double rate = calibration_->cameras[0].rate_hz > 0 ? calibration_->cameras[0].rate_hz : 20;
  return static_cast<std::size_t>(std::max(2L, std::lround(seconds * rate) - 1));
}

/// If the IMU's readings are constant, one camera cannot observe a constant speed. The background
/// must then rest long enough.
Result<Start> Node::startWithoutSpeed(TimePoint now) {
  const Options& options = cameras_->estimator.options();
  const StartOptions& o = options.start;
  constexpr std::chrono::milliseconds kEven{500}, kShortestEven{250};
  if (imu_.empty() || now - imu_.first() < kShortestEven) return fail("start_window_short");
  const Duration even = std::min<Duration>(kEven, now - imu_.first());
  if (imuIsEven(imu_, now, even, options.imu)) {
    const auto still = [&](double seconds) {
      return cameras_->tracker.stillShare(framesIn(seconds)) >= options.rest.still_share;
    };
    const Duration window = durationFromSeconds(o.still_window_s);
    if (still(o.still_window_s) && imuIsEven(imu_, now, window, options.imu)) {
      return startAtRest(imu_, now, options);
    }
    if (cameras_->models.size() == 1 || still(o.rest_window_s)) {
      return fail("start_picture_moves_imu_does_not");
    }
  }
  return motion_initialiser_.start(imu_, cameras_->models);
}

void Node::begin(TimePoint now, const FrameInput& input) {
  if (resume(now)) return;
  const Options& options = cameras_->estimator.options();
  motion_initialiser_.add(input, now);
  const auto frames = std::min(framesIn(options.start.rest_window_s),
                               static_cast<std::size_t>(config_.tracker.memory));
  const std::optional<double> rest_motion = cameras_->tracker.motionSince(frames);
  // Rest needs a whole window. Motion is detected as soon as points have moved farther than rest
  // allows.
  const auto moved = rest_motion ? rest_motion : cameras_->tracker.motionSince(framesIn(0.25));
  const bool moves = moved && *moved >= options.start.rest_disparity_px;
  const bool slow = !input.speed || std::abs(input.speed->speed) < 0.1;
  Result<Start> start = fail("start_waits");
  // A start from older samples would be reset at the next frame.
  constexpr std::chrono::milliseconds kFresh{300};
  const bool fresh =
      !imu_.empty() && toSeconds(imu_.longestGap(now - kFresh, now)) <= config_.core.imu.gap_from_s;
  if (!fresh) {
    start = fail("start_without_samples");
  } else if (rest_motion && *rest_motion < options.start.rest_disparity_px && slow) {
    start = startAtRest(imu_, now, options);
  } else if (input.speed && !slow) {
    start = startWithSpeed(imu_, now, *input.speed, speeds_.samples(), options);
  } else if (!input.speed && moves) {
    start = startWithoutSpeed(now);
  }
  if (!start) {
    last_start_reason_ = start.error().code;
    return reasons_.add(start.error());
  }
  cameras_->estimator.start(*start);
  motion_initialiser_.clear();
}

std::string Node::saveState() const {
  if (!started()) return {};
  SavedState saved = cameras_->estimator.save();
  saved.world = world_;
  saved.next_track = cameras_->tracker.nextId();
  return toText(saved);
}

Result<void> Node::restoreState(const std::string& text) {
  auto saved = fromText(text);
  if (!saved) return tl::unexpected(saved.error());
  if (cameras_ && saved->T_BC.size() != cameras_->models.size()) {
    return fail("state_other_cameras", "the saved state has another number of cameras");
  }
  world_ = saved->world;
  saved_ = std::move(*saved);
  return {};
}

}  // namespace perdure::vio
