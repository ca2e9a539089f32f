#include "services/semantic_filter/core/history.h"

#include <algorithm>
#include <utility>

#include "common/math/gaussian.h"

namespace perdure::semantic_filter {
namespace {

using SharedArrivals = std::shared_ptr<const Arrivals>;

/// Returns `arrivals` without these tracks; the same object if it has none of them.
SharedArrivals without(const std::set<TrackId>& ids, const SharedArrivals& arrivals) {
  const auto isOne = [&](const ObjectBelief& b) { return ids.contains(b.trackId()); };
  const auto isPublished = [&](const Arrivals::Published& p) { return isOne(p.belief); };
  if (std::none_of(arrivals->placed.begin(), arrivals->placed.end(), isOne) &&
      std::none_of(arrivals->as_published.begin(), arrivals->as_published.end(), isPublished)) {
    return arrivals;
  }
  Arrivals rest = *arrivals;
  std::erase_if(rest.placed, isOne);
  std::erase_if(rest.as_published, isPublished);
  return std::make_shared<const Arrivals>(std::move(rest));
}

}  // namespace

History::History(const Parameters& parameters, const ClassPriors& priors, std::size_t frames,
                 ReasonCounts& reasons)
    : parameters_(parameters), most_(frames), reasons_(reasons), filter_(parameters, priors) {}

void History::beginWorld() {
  Learned learned = std::move(belief_.learned);
  belief_ = {};
  belief_.learned = std::move(learned);
  frames_.clear();
  pose_error_ = {};
  last_T_WB_.reset();
  arrivals_.reset();
}

HistoryFrame& History::add(const Odometry& odometry, std::shared_ptr<const CameraModel> camera) {
  advancePoseError(pose_error_, odometry, last_T_WB_, parameters_.pose);
  last_T_WB_ = odometry.T_WB;
  FrameInput input;
  input.stamp = odometry.stamp;
  input.view.camera = camera.get();
  input.view.T_WB = odometry.T_WB;
  input.view.up_W = odometry.up_W;
  input.pose_error = pose_error_;
  frames_.push_back({std::move(input), odometry.world, std::move(camera), {}});
  if (frames_.size() > most_) {
    spare_ = std::move(frames_.front().before);
    frames_.pop_front();
    ids_.forgetBefore(frames_.front().input.stamp.sequence);
  }
  return frames_.back();
}

void History::step() {
  frames_.back().arrivals = std::exchange(arrivals_, nullptr);
  step(frames_.back());
}

void History::step(HistoryFrame& frame) {
  const Model& model = *frame.input.model;
  frame.input.estimated_styles =
      belief_.learned.extents.outlines(model.network) ? model.outline_styles : nullptr;
  if (frame.before.tracks.empty()) frame.before = std::exchange(spare_, {});
  const std::size_t n = belief_.tracks.size();
  if (frame.before.tracks.capacity() < n) frame.before.tracks.reserve(n + n / 4);
  frame.before = belief_;
  frame.merges.clear();
  if (frame.arrivals) frame.merges = takeIn(*frame.arrivals, belief_, frame.input, filter_);
  const StepReport report = filter_.step(belief_, frame.input, ids_);
  frame.merges.insert(frame.merges.end(), report.merges.begin(), report.merges.end());
  if (report.broken > 0) reasons_.add("object_numbers_bad", report.broken);
  frame.stepped = true;
}

void History::stepAgainFrom(std::size_t index) {
  belief_ = frames_[index].before;
  for (std::size_t i = index; i < frames_.size() && frames_[i].stepped; ++i) {
    step(frames_[i]);
    late_merges_.insert(late_merges_.end(), frames_[i].merges.begin(), frames_[i].merges.end());
  }
}

void History::erase(const std::set<TrackId>& ids) {
  std::set<TrackId> gone = ids;
  for (const auto& [track, into] : belief_.fused) {
    if (ids.contains(into)) gone.insert(track);
  }
  const auto from = [&](std::vector<Track>& tracks) {
    std::erase_if(tracks, [&](const Track& t) { return ids.contains(t.id); });
  };
  from(belief_.tracks);
  for (HistoryFrame& f : frames_) {
    from(f.before.tracks);
    if (f.arrivals) f.arrivals = without(gone, f.arrivals);
  }
}

std::optional<ComingFrame> History::comingAfter(const HistoryFrame& frame) const {
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    if (&frames_[i] != &frame) continue;
    const FrameInput& before = frames_[i - 1].input;
    const double seconds = toSeconds(frame.input.stamp.time - before.stamp.time);
    if (seconds <= 0.0 || frames_[i - 1].world != frame.world) return std::nullopt;
    ComingFrame coming{frame.input.view, seconds};
    coming.view.T_WB = frame.input.view.T_WB * (before.view.T_WB.inverse() * frame.input.view.T_WB);
    return coming;
  }
  return std::nullopt;
}

std::vector<MergeRecord> History::takeLateMerges() { return std::exchange(late_merges_, {}); }

}  // namespace perdure::semantic_filter
