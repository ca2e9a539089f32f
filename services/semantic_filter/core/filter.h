// The semantic filter in six verbs: predict, see, associate, update, smooth, tend (eq. 4, 8, 9).
//
// The belief is a plain value and a step is a function of (belief, frame): a late frame is applied
// by taking the belief before it and stepping again (DESIGN 5, item 14).
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/tracks/initiation.h"
#include "services/semantic_filter/core/memory/drift.h"
#include "services/semantic_filter/core/belief/noise_scale.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/tracks/merge.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"

namespace perdure::semantic_filter {

/// One image's worth of input. Without `boxes` it is no evidence; with an empty list it is.
struct FrameInput {
  FrameStamp stamp;
  View view;
  PoseError pose_error;
  std::vector<SightPoint> points;  ///< landmarks seen in this image
  std::optional<std::vector<Evidence>> boxes;
  PrimedAnswers primed = {};  ///< where predictions were asked for and no box met them
  Model model;                ///< that the boxes' classes refer to
};

/// What is true of the networks and of the streets, whatever the world: it outlives a world.
struct Learned {
  ErrorScales sides{4000.0};    ///< of boxes
  ErrorScales azimuths{200.0};  ///< each of another thing
  Evenness evenness = {};
};

struct Belief {
  std::vector<Object> objects;  ///< in order of id
  std::vector<Object> gone;     ///< given up lately, for when they are found again (core/moved.h)
  Learned learned = {};
  Path path = {};  ///< of the body
};

/// Gives ids to births. The same box of the same frame always gets the same id, so that stepping
/// again after a late detection does not rename objects, and no id is ever used twice.
class IdBook {
 public:
  ObjectId idFor(std::uint64_t frame_sequence, std::size_t box);
  ObjectId next() const { return next_; }
  void atLeast(ObjectId next) { next_ = std::max(next_, next); }
  /// Forgets frames before this one; they cannot be stepped again.
  void forgetBefore(std::uint64_t frame_sequence);

 private:
  ObjectId next_ = 1;
  std::map<std::pair<std::uint64_t, std::size_t>, ObjectId> given_;
};

struct StepReport {
  std::vector<PoseEvidence> pose;  ///< of things that came back from an earlier visit
  std::vector<MergeRecord> merges;
  std::size_t broken = 0;  ///< objects whose numbers went bad, and which were dropped
};

class Expected;

class SemanticFilter {
 public:
  SemanticFilter(const Parameters& parameters, const ClassPriors& priors)
      : parameters_(parameters), priors_(priors) {}

  /// Makes `belief`, a copy of that `before` the frame, the one after it.
  StepReport step(const Belief& before, Belief& belief, const FrameInput& heard, IdBook& ids) const;
  /// Of two objects that are known to be one, `id` goes on with what both knew, as of that frame.
  /// Nothing happens where one of them is not there, or their classes exclude each other.
  std::optional<MergeRecord> join(Belief& belief, ObjectId id, ObjectId absorbed,
                                  const FrameInput& input) const;

  const Parameters& parameters() const { return parameters_; }
  const ClassPriors& priors() const { return priors_; }

 private:
  struct Seen {
    std::size_t object;
    ObjectLook look;
    std::optional<std::size_t> own = {};    ///< the box that is surely its own
    bool claimed = false;                   ///< at rest, and a box lies near
    std::optional<PoseEvidence> told = {};  ///< until the look is taken back
  };

  BoxErrors errorsOf(const Belief& belief, const FrameInput& input) const;
  FrameContext contextOf(const Belief& belief, const FrameInput& input) const;
  /// Visibility of all objects, published with them; one Sight for each.
  std::vector<Sight> seeAll(Belief& belief, const FrameInput& input) const;
  std::vector<Seen> score(Belief& belief, const std::vector<Sight>& sights, const FrameInput& input,
                          const FrameContext& frame) const;
  /// Updates what is seen; returns for each box how much of it is claimed.
  Eigen::VectorXd associateAndUpdate(Belief& belief, std::vector<Seen>& seen,
                                     const FrameInput& input, const FrameContext& frame) const;
  /// Whether a look at it will tell of the pose: once for each time that it comes back.
  bool tellsPose(const Object& object, const FrameContext& frame) const;
  /// One as it was scored, until its look was heard: from `was`, as it was before the frame, and
  /// `now`, as it is.
  Object untilLook(const Object& was, const Object& now, const Seen& seen, const FrameInput& input,
                   const FrameContext& frame) const;
  /// Of one object after its look; nothing may be left of it.
  void tend(Object& object, const Object& was, Seen& seen, const FrameInput& input,
            const FrameContext& frame) const;
  static void smoothNeediest(std::vector<Object*>& objects, Belief& belief,
                             const FrameContext& frame);
  /// Of an object with v = 0 there may be a rest to see, which may be detected: its box is less
  /// likely to be clutter, new, or of anything else. The object itself stays as it is.
  void explainRemnants(const Belief& belief, const std::vector<Sight>& sights,
                       FrameInput& input) const;
  /// A box that a hidden object explains far better than any that is in sight says that the blocker
  /// was misjudged: that object can be seen.
  void reveal(Belief& belief, std::vector<Sight>& sights, const FrameInput& input) const;
  /// The rest of an object that is almost out of the image is no new object.
  static bool leavesView(Expected& expected, const Belief& belief, const std::vector<Sight>& sights,
                         const Evidence& box);
  void births(Belief& belief, const std::vector<Sight>& sights, const Eigen::VectorXd& claimed,
              const FrameInput& input, const FrameContext& frame, IdBook& ids) const;

  Parameters parameters_;
  ClassPriors priors_;
};

}  // namespace perdure::semantic_filter
