#include "services/semantic_filter/core/history.h"

#include <algorithm>
#include <utility>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/measurement/pose_error.h"

namespace perdure::semantic_filter {

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

void History::step() { step(frames_.back()); }

void History::step(HistoryFrame& frame) {
  if (frame.before.tracks.empty()) frame.before = std::exchange(spare_, {});
  const std::size_t n = belief_.tracks.size();
  if (frame.before.tracks.capacity() < n) frame.before.tracks.reserve(n + n / 4);
  frame.before = belief_;
  StepReport report = filter_.step(belief_, frame.input, ids_);
  frame.merges = std::move(report.merges);
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

void History::insert(const Track& track) {
  const auto into = [&](Belief& b) {
    const auto at = std::find_if(b.tracks.begin(), b.tracks.end(),
                                 [&](const Track& t) { return t.id > track.id; });
    b.tracks.insert(at, track);
  };
  into(belief_);
  for (HistoryFrame& f : frames_) into(f.before);
}

void History::erase(const std::set<ObjectId>& ids) {
  const auto from = [&](std::vector<Track>& tracks) {
    std::erase_if(tracks, [&](const Track& t) { return ids.contains(t.id); });
  };
  from(belief_.tracks);
  for (HistoryFrame& f : frames_) from(f.before.tracks);
}

void History::join(ObjectId id, ObjectId absorbed, const FrameInput& input) {
  if (const auto merge = filter_.join(belief_, id, absorbed, input)) {
    late_merges_.push_back(*merge);
  }
  for (HistoryFrame& f : frames_) (void)filter_.join(f.before, id, absorbed, f.input);
}

bool History::split(ObjectId id, ObjectId absorbed) {
  const auto rename = [&](std::vector<Track>& tracks) {
    const auto find = [&](ObjectId wanted) {
      return std::find_if(tracks.begin(), tracks.end(),
                          [&](const Track& o) { return o.id == wanted; });
    };
    const auto joined = find(id);
    if (joined == tracks.end()) return false;
    const bool is_seen = !joined->life.recalled && find(absorbed) == tracks.end();
    if (!is_seen) {  // before the join, or laid and not seen since
      tracks.erase(joined);
      return false;
    }
    joined->id = absorbed;
    std::sort(tracks.begin(), tracks.end(),
              [](const Track& a, const Track& b) { return a.id < b.id; });
    return true;
  };
  for (HistoryFrame& f : frames_) (void)rename(f.before.tracks);
  return rename(belief_.tracks);
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
