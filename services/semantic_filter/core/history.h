// The latest frames, each with the belief before it, so that late detections give the posterior
// that they would have given on time. Also: the pose error from frame to frame.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "common/base/result.h"
#include "common/types/odometry.h"
#include "services/semantic_filter/core/filter.h"
#include "services/semantic_filter/core/memory/arrivals.h"
#include "services/semantic_filter/core/visibility/predicted_box.h"

namespace perdure::semantic_filter {

struct HistoryFrame {
  FrameInput input;
  WorldId world;
  std::shared_ptr<const CameraModel> camera;  ///< keeps input.view.camera alive
  Belief before;
  bool stepped = false;
  std::shared_ptr<const Arrivals> arrivals = {};  ///< from the map; null: none
  std::vector<MergeRecord> merges = {};  ///< of its latest step
};

class History {
 public:
  /// Keeps `frames` frames. Counts in `reasons`, which outlives this.
  History(const Parameters& parameters, const ClassPriors& priors, std::size_t frames,
          ReasonCounts& reasons);
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  /// Another frame of reference begins: what was learned of networks and streets stays.
  void beginWorld();
  /// Adds a frame that is newer than all before, not yet stepped. The oldest leaves.
  HistoryFrame& add(const Odometry& odometry, std::shared_ptr<const CameraModel> camera);
  /// Takes these in with the next frame that is stepped for the first time.
  void arrive(std::shared_ptr<const Arrivals> arrivals) { arrivals_ = std::move(arrivals); }
  /// Steps the newest frame.
  void step();
  /// Steps frame `index` and all stepped ones after it again.
  void stepAgainFrom(std::size_t index);

  /// From the newest belief and those that late detections may go back to, with what arrived of
  /// them.
  void erase(const std::set<TrackId>& ids);

  std::deque<HistoryFrame>& frames() { return frames_; }
  const std::deque<HistoryFrame>& frames() const { return frames_; }
  bool empty() const { return frames_.empty(); }
  HistoryFrame& newest() { return frames_.back(); }
  TimePoint oldestTime() const { return frames_.front().input.stamp.time; }
  /// The frame after `frame`, if body and clock go on as since the frame before it.
  std::optional<ComingFrame> comingAfter(const HistoryFrame& frame) const;
  /// Merges of frames that were stepped again, since the last call.
  std::vector<MergeRecord> takeLateMerges();

  const Belief& belief() const { return belief_; }
  IdBook& ids() { return ids_; }
  const IdBook& ids() const { return ids_; }
  const PoseError& poseError() const { return pose_error_; }
  /// Pose of the newest frame in W.
  const std::optional<RigidTransform>& lastPose() const { return last_T_WB_; }

 private:
  void step(HistoryFrame& frame);

  Parameters parameters_;
  std::size_t most_;
  ReasonCounts& reasons_;
  SemanticFilter filter_;
  std::deque<HistoryFrame> frames_;
  Belief belief_;
  Belief spare_;  ///< an old one, whose memory the next copy takes
  IdBook ids_;
  PoseError pose_error_;
  std::optional<RigidTransform> last_T_WB_;
  std::vector<MergeRecord> late_merges_;
  std::shared_ptr<const Arrivals> arrivals_;  ///< not yet taken in
};

}  // namespace perdure::semantic_filter
