#include "services/semantic_filter/core/arrivals.h"

#include <algorithm>
#include <utility>

#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/belief/track_message.h"

namespace perdure::semantic_filter {
namespace {

Track placedTrack(const ObjectBelief& belief, const FrameInput& input, ExistenceEvidence evidence) {
  Track track = fromBelief(belief, input.pose_error.product, evidence);
  for (Hypothesis& h : track.hypotheses.write()) {
    addPoseError(h, input.view.T_WB, input.view.up_W, input.pose_error.covariance);
  }
  return track;
}

class Arrival {
 public:
  Arrival(const Arrivals& arrivals, Belief& belief, const FrameInput& input,
          const SemanticFilter& filter)
      : arrivals_(arrivals), belief_(belief), input_(input), filter_(filter) {
    std::erase_if(belief_.fused, [&](const auto& each) { return find(each.second) == end(); });
  }

  void add(Track track) {
    const auto same = find(track.id);
    if (same != end() && !same->life.recalled) return;
    if (const auto fused = belief_.fused.find(track.id); fused != belief_.fused.end()) {
      if (arrivals_.objectOf(track.id) == arrivals_.objectOf(fused->second)) return;
      belief_.fused.erase(fused);  // they are two objects again
    }
    if (same != end()) {
      *same = std::move(track);
      return;
    }
    const auto later = std::find_if(belief_.tracks.begin(), belief_.tracks.end(),
                                    [&](const Track& t) { return t.id > track.id; });
    belief_.tracks.insert(later, std::move(track));
  }

  std::vector<MergeRecord> unite() {
    std::map<ObjectId, std::vector<TrackId>> objects;
    for (const auto& [track, object] : arrivals_.members) objects[object].push_back(track);
    std::vector<MergeRecord> fused;
    for (auto& [object, tracks] : objects) {
      tracks.push_back(object);  // the id of the object is also the id of a track
      std::erase_if(tracks, [&](TrackId track) { return find(track) == end(); });
      std::stable_sort(tracks.begin(), tracks.end(), [&](TrackId a, TrackId b) {
        return find(a)->life.recalled < find(b)->life.recalled;
      });
      for (std::size_t i = 1; i < tracks.size(); ++i) unite(tracks.front(), tracks[i], fused);
    }
    return fused;
  }

 private:
  using Tracks = std::vector<Track>;

  Tracks::iterator end() { return belief_.tracks.end(); }
  Tracks::iterator find(TrackId id) {
    return std::find_if(belief_.tracks.begin(), belief_.tracks.end(),
                        [id](const Track& t) { return t.id == id; });
  }

  void unite(TrackId goes_on, TrackId other, std::vector<MergeRecord>& fused) {
    if (filter_.join(belief_, goes_on, other, input_)) {
      belief_.fused[other] = goes_on;
      fused.push_back({.survivor = goes_on, .absorbed = other, .by_map = true});
    } else if (const auto unseen = find(other); unseen->life.recalled) {
      find(goes_on)->life.merge(unseen->life);  // both are one object, whatever its class
      belief_.tracks.erase(unseen);
      fused.push_back({.survivor = goes_on, .absorbed = other, .by_map = true});
    }
  }

  const Arrivals& arrivals_;
  Belief& belief_;
  const FrameInput& input_;
  const SemanticFilter& filter_;
};

}  // namespace

ObjectId Arrivals::objectOf(TrackId track) const {
  const auto at = members.find(track);
  return at == members.end() ? track : at->second;
}

std::vector<MergeRecord> takeIn(const Arrivals& arrivals, Belief& belief, const FrameInput& input,
                                const SemanticFilter& filter) {
  Arrival arrival(arrivals, belief, input, filter);
  for (const ObjectBelief& each : arrivals.placed) {
    arrival.add(placedTrack(each, input, arrivals.evidence));
  }
  for (const auto& [each, product] : arrivals.as_published) {
    arrival.add(fromBelief(each, product, arrivals.evidence));
  }
  return arrival.unite();
}

}  // namespace perdure::semantic_filter
