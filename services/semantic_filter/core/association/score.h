// Score: how each hypothesis of an object explains each box (eq. 7 at b = π(g s)), and how much a
// look is worth beside earlier looks from the same place (DESIGN 5, items 5 and 7).
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/measurement/detection.h"
#include "services/semantic_filter/core/update/predict.h"
#include "services/semantic_filter/core/belief/class_prior.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

struct KeyView;
class Ground;

/// Of the boxes of one network and their azimuths, beside what is assumed of them.
struct BoxErrors {
  std::uint64_t model = 0;
  double noise = 1.0;    ///< of the sides' variances: ErrorScales::ratio
  double azimuth = 1.0;  ///< of the azimuths'; heard by fits of many looks alone
  /// The same of b. What the looks at one thing have in common passes for its place and size: what
  /// is left over of fits tells of b by half only, as networks go.
  double lasting() const { return std::sqrt(noise); }
};

/// How a hypothesis explains one box.
struct BoxFit {
  double likelihood = 0.0;  ///< L(z), 0 outside the gate
  double nis = 0.0;         ///< per degree of freedom, where likelihood > 0
  int part = -1;            ///< BoxScore::part
};

/// One hypothesis in one frame.
struct HypothesisLook {
  std::optional<ProjectedBox> box;
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of the predicted sides, without R
  double detection = 0.0;    ///< v P_D: probability that the network reports it
  double missed = 0.0;       ///< v (1 - P_D): that it is in sight and not reported
  double silent = 1.0;       ///< A without a box: 1 - v P_D, and what a primed answer says
  std::vector<BoxFit> fits;  ///< for each box of the look
  double expected = 0.0;     ///< v P_D of its class, whatever is known of the object itself
  double late_looks = 0.0;   ///< earlier looks that share this view, if it is true
};

struct ObjectLook {
  Sight sight;
  bool primed = false;             ///< the network was asked about it (core/primed.h)
  std::vector<std::size_t> boxes;  ///< of the frame, those that lie near one of the hypotheses
  std::vector<HypothesisLook> hypotheses;
};

/// Everything about one frame that scoring, updating and birth need.
struct FrameContext {
  View view;
  PoseError pose_error;
  const Model* model = nullptr;
  const ClassPriors* priors = nullptr;
  const Parameters* parameters = nullptr;
  std::shared_ptr<const KeyView> key_view = {};  ///< of this frame, for what is remembered
  BoxErrors errors = {};
  std::shared_ptr<const Ground> ground = {};  ///< before this frame; none: nothing is known of it

  /// Of `view`.
  Projector projector() const;
  /// How the network draws its boxes about things of a class, as projectObserved takes it.
  const BoxStyle& styleOf(const std::string& class_name) const {
    static const BoxStyle plain;
    return model ? model->styles->of(class_name) : plain;
  }
};

/// Changes of view after which what hides a thing, or makes the network miss it, is another.
ViewScales screenScales(const VisibilityParameters& visibility);
/// What changes at an object with the view of this frame.
ViewWalk viewWalkOf(const FrameContext& frame);

/// log of the density of clutter, of the sides that were compared: one of fewer is of other units.
double logClutterOf(const Evidence& e, const BoxScore& score, const View& view,
                    const ClutterParameters& parameters);

/// By what P_D and what is visible are to be multiplied: what is screened is not found, what is
/// elusive seldom.
double shareFound(const Object& object, double elusive_found);

/// Of an azimuth of which the network says `told`, rad, as is assumed at first.
double azimuthSigma(double told, const ClassPrior& prior);

/// P_D of a class for an instance of this size in pixels (√ of its box's area), fully visible.
double detectionProbability(const ClassPrior& prior, double size_px, const FrameContext& frame);

ObjectLook look(const Object& object, const Sight& sight, const std::vector<Evidence>& boxes,
                const FrameContext& frame);

/// The sides of one of the frame's boxes that something hides: by the hypothesis that explains it
/// best.
std::array<bool, 4> hiddenSides(const ObjectLook& look, std::size_t box);

/// "Object made this box of the look" against "object made none, or is not there".
double associationWeight(const Object& object, const ObjectLook& look, std::size_t box);

/// Earlier looks that a look at `position` from here shares its errors with.
double sharedLooks(const Eigen::Vector3d& position, const ViewPoint& last, const View& view,
                   const LooksParameters& parameters);
/// Information of one more look after n correlated ones, in units of the first:
/// I(n) = n / (ρ n + 1 - ρ), worth = I(n+1) - I(n).
double worthOfLook(double looks, double correlation);

}  // namespace perdure::semantic_filter
