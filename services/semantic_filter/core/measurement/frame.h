// Everything about one image that the filter needs: input, view, pose error, learned errors.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/belief/view_change.h"
#include "services/semantic_filter/core/measurement/detection.h"
#include "services/semantic_filter/core/measurement/view.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// The error of the body's pose at one frame, [θ, p].
struct PoseError {
  Matrix6d covariance = Matrix6d::Zero();
  /// Product of the transitions of all frames so far: an track that was brought up to date at
  /// product A has at product B the cross-covariance C (B A⁻¹)ᵀ.
  Matrix6d product = Matrix6d::Identity();
};

/// A landmark in the image: what stands between the camera and an track, or behind it.
struct LandmarkDepth {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double distance_m = 0.0;
  double sigma_m = 0.0;
};

/// One image's worth of input. Without `boxes` it is no evidence; with an empty list it is.
struct FrameInput {
  FrameStamp stamp;
  View view;
  PoseError pose_error;
  std::vector<LandmarkDepth> points;  ///< landmarks seen in this image
  std::optional<std::vector<BoxDetection>> boxes;
  TopDownAnswers top_down = {};  ///< where predictions were asked for and no box met them
  Model model;                   ///< that the boxes' classes refer to
};

/// Of the boxes of one network and their azimuths, beside what is assumed of them.
struct NoiseScale {
  std::uint64_t model = 0;
  double noise = 1.0;    ///< of the sides' variances: NoiseScales::ratio
  double azimuth = 1.0;  ///< of the azimuths'; heard by fits of many looks alone
  /// The same of b. What the looks at one thing have in common passes for its place and size: what
  /// is left over of fits tells of b by half only, as networks go.
  double lasting() const { return std::sqrt(noise); }
};

/// From where a frame's looks were taken; shared by all of them, and owner of its camera.
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
  Matrix6d product_inverse;  ///< of error.product; not finite where there is none
  TimePoint time;
  RigidTransform T_WC;
  Projector projector;
  std::shared_ptr<const BoxStyles> styles;  ///< of the network that looked
  NoiseScale noise_scale;                   ///< of its boxes, as they were thought to be
};

/// One box that was surely the track's.
struct Keyframe {
  std::shared_ptr<const FrameView> from;
  BoxMeasurement z;
  std::array<bool, 4> hidden{};  ///< sides that something nearer hides
  std::optional<double> azimuth;
  double azimuth_sigma = 0.35;
};

/// Everything about one frame that scoring, updating and birth need.
struct FrameContext {
  View view;
  PoseError pose_error;
  const Model* model = nullptr;
  const ClassPriors* priors = nullptr;
  const Parameters* parameters = nullptr;
  std::shared_ptr<const FrameView> frame_view = {};  ///< of this frame, for what is remembered
  NoiseScale noise_scale = {};
  std::shared_ptr<const GroundSurface> ground =
      {};  ///< before this frame; none: nothing is known of it

  /// Of `view`.
  Projector projector() const;
  /// How the network draws its boxes about things of a class, as projectObserved takes it.
  const BoxStyle& styleOf(const std::string& class_name) const {
    static const BoxStyle plain;
    return model ? model->styles->of(class_name) : plain;
  }
};

/// What changes at an track as the view of it changes, and goes back to where it began.
struct ViewWalk {
  RigidTransform T_WC;  ///< the new view
  double focal = 1.0;   ///< pixels
  SideError lasting;    ///< of b, stationary
  ViewScales bias{1, 1, 1};
  double unmapped_occluder = 0.0;  ///< Track::unmapped_occluder, stationary
  double hard_to_detect = 0.0;     ///< Track::hard_to_detect, stationary
  ViewScales screen{1, 1, 1};
};

/// Changes of view after which the detector bias has fallen to 1/e.
ViewScales biasScales(const BoxParameters& box);
/// Changes of view after which what hides a thing, or makes the network miss it, is another.
ViewScales detectabilityScales(const VisibilityParameters& visibility);
/// What changes at an track with the view of this frame.
ViewWalk viewWalkOf(const FrameContext& frame);

}  // namespace perdure::semantic_filter
