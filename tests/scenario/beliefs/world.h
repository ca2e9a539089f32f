// Random worlds whose statistics equal the filter's model, so that any miscalibration is the
// filter's own. There are no images: boxes are projections of cuboids plus the declared noise.
//
// The filter's configuration and class priors give: class frequencies, sizes, motion and speed,
// survival; detection probability, occluders, correlations of activations and box errors; false
// boxes; the random walk of the poses. The simulated detector gives the classes and the separation
// of their features. Three properties are chosen here: the density of objects, the image size at
// which they become visible, and the camera's motion. A box always covers the whole cuboid, even if
// part of it is occluded.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/sim/detector.h"
#include "common/sim/dice.h"
#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/measurement/detection.h"
#include "services/semantic_filter/core/update/predict.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::test {

/// The filter's configuration and the detector's model, from which the world is drawn.
struct Told {
  semantic_filter::Config config;
  semantic_filter::ClassPriors priors;
  sim::DetectorModel detector;
};
/// Reads the files in config/; `assignments` as for `perdure pipeline --set`. The detector is often
/// uncertain at any box size, because clear activations would hardly test the calibration.
Told readTold(const std::vector<std::string>& assignments = {});

/// Effects that can be switched off, to find the cause of an error.
struct WorldOptions {
  std::uint64_t seed = 1;
  std::uint64_t frames = 120;
  double rate_hz = 5.0, speed = 10.0;  ///< m/s
  double things_per_m = 0.8;
  bool pose_noise = true, clutter = true, motion = true, screens = true, hiding = true;
  bool azimuths = true;
  bool lasting_errors = true;  ///< b; if false, all noise is independent
  bool shared_looks = true;    ///< observations from one place have correlated errors
  double tail = 0.0;           ///< degrees of freedom of the boxes' noise; 0: Gaussian
};

struct Thing {
  std::string class_name;
  semantic_filter::State x = semantic_filter::State::Zero();  ///< state at t = 0, with velocity
  double present_until_s = 1e9;
  /// The object becomes visible (as from round a corner) when its image has this size. Sizes are
  /// log-uniform, as those of false boxes are, because `initiation.odds` applies to boxes of any
  /// size.
  double comes_out_px = 0.0;
  bool moves() const { return x.tail<3>().squaredNorm() > 0.0; }
  semantic_filter::State at(double t_s) const;
};

/// One frame: the inputs of the filter, and the truth.
struct WorldFrame {
  double t_s = 0.0;
  Odometry odometry;
  Detections detections;
  semantic_filter::View true_view;                               ///< view with the true pose
  ScratchVector<semantic_filter::TrackVisibility> visibilities;  ///< visibility of each object
  std::vector<std::optional<Box>> outlines;  ///< the part within the image, even if occluded
  std::vector<int> origins;                  ///< true object of each box, or -1
};

class World {
 public:
  World(const WorldOptions& options, const Told& told);

  const ModelInfo& model() const { return model_; }
  const CameraModel& camera() const { return camera_; }
  const std::vector<Thing>& things() const { return things_; }
  /// True if the object exists and has become visible.
  bool present(std::size_t thing, double t_s) const {
    return errors_[thing].out && t_s < things_[thing].present_until_s;
  }
  /// Returns the next frame, from frame 0 on.
  WorldFrame next();

 private:
  /// Unit Gaussians that change with the view of an object.
  struct Drift {
    Eigen::VectorXd values;
    void draw(sim::Dice& dice, double keep);
  };
  struct Errors {
    std::optional<RigidTransform> last_T_WC;
    Drift box, looks;
    Eigen::Vector4d noise = Eigen::Vector4d::Zero();  ///< unit Gaussians of the last box
    double noise_stays = 0.0;                         ///< correlation with the noise of the next
                                                      ///< box
    bool unmapped_occluder = false, hard_to_detect = false, out = false;
  };

  void place();
  std::optional<Thing> draw(const std::string& class_name, double x_m);
  RigidTransform truePose(double t_s) const;
  Odometry odometry(std::uint64_t frame, double t_s);
  void computeVisibility(WorldFrame& frame);
  void changeView(std::size_t thing, const semantic_filter::State& x, const RigidTransform& T_WC);
  std::optional<Detection> look(std::size_t thing, const semantic_filter::State& x,
                                const WorldFrame& frame);
  Box withErrors(const Box& box, const std::vector<float>& activations, Errors& errors);
  /// `class_index` is classes.size() for clutter; `shared` are the shared errors of the object's
  /// observations.
  std::vector<float> activations(std::size_t class_index, double size_px,
                                 const Eigen::VectorXd& shared);
  std::pair<double, double> falseExtent(double extent);
  void addClutter(std::vector<std::pair<Detection, int>>& boxes);
  double azimuth(const Eigen::VectorXd& shared, double alpha);

  WorldOptions options_;
  Told told_;
  sim::Dice dice_, elusive_dice_;  ///< a separate generator, so that the other draws of a seed do
                                   ///< not depend on it
  CameraModel camera_;
  ModelInfo model_;
  semantic_filter::Model read_model_;
  Eigen::MatrixXd directions_;
  std::vector<Thing> things_;
  std::vector<Errors> errors_;
  std::uint64_t frame_ = 0;
  std::optional<RigidTransform> last_T_WB_;
  Eigen::Matrix<double, 6, 1> pose_error_ = Eigen::Matrix<double, 6, 1>::Zero();  // [θ, p]
  Matrix6d pose_covariance_ = Matrix6d::Zero();
};

}  // namespace perdure::test
