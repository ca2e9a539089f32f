// The latest frames with the belief before each. With them, late detections give the same posterior
// as timely ones.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "common/base/result.h"
#include "common/types/odometry.h"
#include "services/semantic_filter/core/arrivals.h"
#include "services/semantic_filter/core/filter.h"
#include "services/semantic_filter/core/visibility/predicted_box.h"

namespace perdure::semantic_filter {

struct HistoryFrame {
  FrameInput input;
  WorldId world;
  std::shared_ptr<const CameraModel> camera;  ///< keeps input.view.camera alive
  Belief before;
  bool stepped = false;
  std::shared_ptr<const Arrivals> arrivals = {};  ///< from the map; null: none
  std::vector<MergeRecord> merges = {};           ///< merges of its last step
};

class History {
 public:
  /// Stores at most `frames` frames. Counts invalid tracks in `reasons`, which must outlive this.
  History(const Parameters& parameters, const ClassPriors& priors, std::size_t frames,
          ReasonCounts& reasons);
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  /// Begins another frame of reference: removes tracks and frames, keeps the learned parameters.
  void beginWorld();
  /// Adds a frame that is newer than all others and not yet stepped. Removes the oldest frame if
  /// there are too many.
  HistoryFrame& add(const Odometry& odometry, std::shared_ptr<const CameraModel> camera);
  /// The next frame that is stepped for the first time takes the arrivals in.
  void arrive(std::shared_ptr<const Arrivals> arrivals) { arrivals_ = std::move(arrivals); }
  void step();
  /// Steps frame `index` and all stepped ones after it again.
  void stepAgainFrom(std::size_t index);

  /// Removes tracks from all beliefs and from the arrivals of all frames.
  void erase(const std::set<TrackId>& ids);

  std::deque<HistoryFrame>& frames() { return frames_; }
  bool empty() const { return frames_.empty(); }
  HistoryFrame& newest() { return frames_.back(); }
  TimePoint oldestTime() const { return frames_.front().input.stamp.time; }
  /// Predicts the frame after `frame`, with the motion and the time step since the previous frame.
  /// Returns nothing without a previous frame of the same world.
  std::optional<ComingFrame> comingAfter(const HistoryFrame& frame) const;
  /// Returns the merges of frames that were stepped again since the last call.
  std::vector<MergeRecord> takeLateMerges();

  const Belief& belief() const { return belief_; }
  IdBook& ids() { return ids_; }
  const PoseError& poseError() const { return pose_error_; }
  const std::optional<RigidTransform>& lastPose() const { return last_T_WB_; }

 private:
  void step(HistoryFrame& frame);

  Parameters parameters_;
  std::size_t most_;
  ReasonCounts& reasons_;
  SemanticFilter filter_;
  std::deque<HistoryFrame> frames_;
  Belief belief_;
  Belief spare_;  ///< an old belief, whose memory the next copy reuses
  IdBook ids_;
  PoseError pose_error_;
  std::optional<RigidTransform> last_T_WB_;
  std::vector<MergeRecord> late_merges_;
  std::shared_ptr<const Arrivals> arrivals_;  ///< not yet taken in
};

}  // namespace perdure::semantic_filter
