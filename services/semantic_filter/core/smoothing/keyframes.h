// The looks at an object that are remembered, so that a static thing can be estimated again from
// all of them at once: a filter that linearised at a wrong first depth, or that took the visible
// part of a thing for the whole, stays wrong; the batch does not.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/math/gaussian.h"
#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// From where a frame's looks were taken; shared by all of them, and owner of its camera.
struct KeyView {
  KeyView(const View& of, const PoseError& pose_error, TimePoint at,
          std::shared_ptr<const BoxStyles> of_model, BoxErrors box_errors = {})
      : camera(*of.camera),
        view(of),
        error(pose_error),
        product_inverse(inverse(pose_error.product)),
        time(at),
        T_WC(of.T_WC()),
        projector(of),
        styles(std::move(of_model)),
        errors(box_errors) {
    view.camera = projector.camera = &camera;
  }
  KeyView(const KeyView&) = delete;
  KeyView& operator=(const KeyView&) = delete;

  CameraModel camera;
  View view;
  PoseError error;
  Matrix6d product_inverse;  ///< of error.product; not finite where there is none
  TimePoint time;
  RigidTransform T_WC;
  Projector projector;
  std::shared_ptr<const BoxStyles> styles;  ///< of the network that looked
  BoxErrors errors;                         ///< of its boxes, as they were thought to be
};

/// One box that was surely the object's.
struct Keyframe {
  std::shared_ptr<const KeyView> from;
  BoxMeasurement z;
  std::array<bool, 4> hidden{};  ///< sides that something nearer hides
  std::optional<double> azimuth;
  double azimuth_sigma = 0.35;
};

/// Takes the look in if it shows the object from where no remembered one does. Where there are
/// `limit` already, the one that tells least beside its neighbours goes. Whether anything changed.
bool remember(Object& object, Keyframe keyframe, const ViewScales& scales,
              const SmoothParameters& parameters);

/// Whether the look may have been at `h`.
bool explains(const Hypothesis& h, const Keyframe& look, const BoxParameters& parameters);

/// What two objects that are one remember, in order of time.
void joinKeyframes(Object& a, const Object& b, const ViewScales& scales,
                   const SmoothParameters& parameters);

}  // namespace perdure::semantic_filter
