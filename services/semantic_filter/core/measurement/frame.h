// The data of one image that the filter needs: input, view, pose error, learned noise scales, and
// the keyframes taken from it. Derivation: tools/docs/maths/pose_error.md.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/belief/learned.h"
#include "services/semantic_filter/core/belief/view_change.h"
#include "services/semantic_filter/core/measurement/detection.h"
#include "services/semantic_filter/core/measurement/view.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// Error of the body's pose at one frame, [θ, p] (rad, m).
struct PoseError {
  Matrix6d covariance = Matrix6d::Zero();
  /// Product of the transitions of all frames. C of a track at product A becomes C (B A⁻¹)ᵀ at
  /// product B.
  Matrix6d product = Matrix6d::Identity();
  /// Whether the covariance is that of the odometry. Corrections reduce it, so cross-covariances
  /// may become too large for it (belief/pose_correlation.h). A random walk only increases it.
  bool reported = false;
};

/// Advances `error` from the previous frame to the frame of `odometry`. `last_T_WB`: pose of the
/// previous frame. Without it the random walk adds nothing.
void advancePoseError(PoseError& error, const Odometry& odometry,
                      const std::optional<RigidTransform>& last_T_WB,
                      const PoseParameters& parameters);

/// A landmark in the image. It lies in front of an object or behind it.
struct LandmarkDepth {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double distance_m = 0.0;
  double sigma_m = 0.0;
};

/// The input of one frame. Without `boxes` it is no evidence. An empty list of boxes is a miss of
/// every visible track.
struct FrameInput {
  FrameStamp stamp;
  View view;
  PoseError pose_error;
  std::vector<LandmarkDepth> points;  ///< landmarks in this image
  std::optional<std::vector<BoxDetection>> boxes;
  TopDownAnswers top_down = {};  ///< for predictions without a reported box
  /// the classes of the boxes refer to it; never null
  std::shared_ptr<const Model> model = std::make_shared<const Model>();
  /// styles by the estimated extent of the boxes; null: `model->styles`
  std::shared_ptr<const BoxStyles> estimated_styles = nullptr;

  const std::shared_ptr<const BoxStyles>& styles() const {
    return estimated_styles ? estimated_styles : model->styles;
  }
};

/// Noise scales of the boxes and azimuths of one network.
struct NoiseScale {
  std::uint64_t model = 0;
  SideScales sides = {};
  double azimuth = 1.0;  ///< of the variances of the azimuths; only batch estimates use it
};

/// The viewpoint of a frame. All keyframes of the frame share it. It owns its camera.
struct FrameView {
  FrameView(const View& of, const PoseError& pose_error, TimePoint at,
            std::shared_ptr<const BoxStyles> of_model, NoiseScale scale = {})
      : camera(*of.camera),
        view(of),
        error(pose_error),
        product_inverse(inverse(pose_error.product)),
        time(at),
        T_WC(of.T_WC()),
        projector(of),
        styles(std::move(of_model)),
        noise_scale(scale) {
    view.camera = projector.camera = &camera;
  }
  FrameView(const FrameView&) = delete;
  FrameView& operator=(const FrameView&) = delete;

  CameraModel camera;
  View view;
  PoseError error;
  Matrix6d product_inverse;  ///< of error.product; not finite if it has no inverse
  TimePoint time;
  RigidTransform T_WC;
  Projector projector;
  std::shared_ptr<const BoxStyles> styles;  ///< of the network that made the boxes
  NoiseScale noise_scale;                   ///< of its boxes, as estimated at `time`
};

/// An observation with an assigned box that is stored for the batch estimate.
struct Keyframe {
  std::shared_ptr<const FrameView> from;
  BoxMeasurement z;
  std::array<bool, 4> hidden{};  ///< sides that a nearer object hides
  std::optional<double> azimuth;
  double azimuth_sigma = 0.35;
};

/// The data of one frame that scoring, updating and initiation need.
struct FrameContext {
  View view;
  PoseError pose_error;
  const Model* model = nullptr;
  const ClassPriors* priors = nullptr;
  const Parameters* parameters = nullptr;
  std::shared_ptr<const FrameView> frame_view = {};  ///< of this frame, for its keyframes
  NoiseScale noise_scale = {};
  std::shared_ptr<const GroundSurface> ground = {};  ///< before this frame; null: not known
  const MoverShares* movers = nullptr;               ///< null: the shares of the class priors
  /// Box styles of the present network, also used for its earlier keyframes. Null: as declared.
  const BoxStyles* styles = nullptr;
  double size_scale = 1.0;        ///< learned over assumed size at which P_D is halved
  bool estimates_extent = false;  ///< true while the extent of the boxes is estimated

  Projector projector() const;
  /// Returns the prior probability that an instance of the class moves.
  double moverShare(const ClassPrior& prior) const {
    return movers ? movers->of(prior) : prior.moving;
  }
  /// Returns the styles of the boxes of an earlier frame. If its network is the present one, these
  /// are the present styles, because the estimated extent of the boxes may have changed.
  const BoxStyles& stylesOf(const FrameView& from) const {
    return styles && from.noise_scale.model == noise_scale.model ? *styles : *from.styles;
  }
  /// Returns the style of the present network's boxes for a class, as projectObserved needs it.
  const BoxStyle& styleOf(const std::string& class_name) const {
    static const BoxStyle plain;
    if (styles) return styles->of(class_name);
    return model ? model->styles->of(class_name) : plain;
  }
};

/// Parameters of a view change: b and detectability of a track return to their stationary values.
struct ViewWalk {
  RigidTransform T_WC;  ///< the new view
  double focal = 1.0;   ///< px
  SideError lasting;    ///< stationary deviation of b
  ViewScales bias{1, 1, 1};
  double unmapped_occluder = 0.0;  ///< stationary probability of an unmapped occluder
  ViewScales occluder{1, 1, 1};
  double hard_to_detect = 0.0;  ///< stationary probability of a view with rare detections
  ViewScales detectability{1, 1, 1};
};

/// Returns the view changes after which the detector bias has fallen to 1/e.
ViewScales biasScales(const BoxParameters& box);
/// Returns the view changes after which the correlation of detectability has fallen to 1/e.
ViewScales detectabilityScales(const VisibilityParameters& visibility);
ViewWalk viewWalkOf(const FrameContext& frame);

}  // namespace perdure::semantic_filter
