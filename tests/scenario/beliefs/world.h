// Random worlds whose statistics are those that the filter is told: what it then believes wrongly
// is its own fault. Without pictures: boxes are cuboids' projections plus the declared noise.
//
// Drawn from the filter's own configuration and class priors: how frequent classes are, their
// sizes, what moves and how fast, how long things stay; how often a thing is found, what hides it,
// how its looks and its boxes' errors are alike; false boxes; the walk of the poses. From the
// simulated detector's: the classes and how well their features part. Stated nowhere, hence chosen
// here: how dense things stand, at which size they come into visibility, and how the camera drives.
// A box is that of the whole cuboid, whatever hides part of it.
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

/// What is told to the filter, and hence what the world is made from.
struct Told {
  semantic_filter::Config config;
  semantic_filter::ClassPriors priors;
  sim::DetectorModel detector;
};
/// Of the files in config/; `assignments` as of `perdure pipeline --set`. The detector is often
/// unsure, at any size of a box: else there were little to be right or wrong about.
Told readTold(const std::vector<std::string>& assignments = {});

/// Parts of the world that can be left out, to see what is to blame for what.
struct WorldOptions {
  std::uint64_t seed = 1;
  std::uint64_t frames = 120;
  double rate_hz = 5.0, speed = 10.0;  ///< m/s
  double things_per_m = 0.8;
  bool pose_noise = true, clutter = true, motion = true, screens = true, hiding = true;
  bool azimuths = true;
  bool lasting_errors = true;  ///< b; without it all noise is new
  bool shared_looks = true;    ///< of one place look alike
  double tail = 0.0;           ///< degrees of freedom of the boxes' noise; 0: Gaussian
};

struct Thing {
  std::string class_name;
  semantic_filter::State x = semantic_filter::State::Zero();  ///< at t = 0; velocity with it
  double present_until_s = 1e9;
  /// It comes into visibility (round a corner) once its image is this large; sizes are log-uniform,
  /// as those of false boxes are: `initiation.odds` is told of boxes of any size.
  double comes_out_px = 0.0;
  bool moves() const { return x.tail<3>().squaredNorm() > 0.0; }
  semantic_filter::State at(double t_s) const;
};

/// One frame: what the filter gets, and what is true.
struct WorldFrame {
  double t_s = 0.0;
  Odometry odometry;
  Detections detections;
  semantic_filter::View true_view;                               ///< with the true pose
  ScratchVector<semantic_filter::TrackVisibility> visibilities;  ///< of each thing
  std::vector<std::optional<Box>> outlines;  ///< the part within the image, whatever hides it
  std::vector<int> origins;                  ///< of each box: the thing, or -1
};

class World {
 public:
  World(const WorldOptions& options, const Told& told);

  const ModelInfo& model() const { return model_; }
  const CameraModel& camera() const { return camera_; }
  const std::vector<Thing>& things() const { return things_; }
  /// There, and not round a corner.
  bool present(std::size_t thing, double t_s) const {
    return errors_[thing].out && t_s < things_[thing].present_until_s;
  }
  /// The frames, from 0, once each.
  WorldFrame next();

 private:
  /// Unit Gaussians that change as the view of a thing does.
  struct Drift {
    Eigen::VectorXd values;
    void draw(sim::Dice& dice, double keep);
  };
  struct Errors {
    std::optional<RigidTransform> last_T_WC;
    Drift box, looks;
    Eigen::Vector4d noise = Eigen::Vector4d::Zero();  ///< of the last box, unit Gaussians
    double noise_stays = 0.0;                         ///< correlation of the next one with it
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
  /// `class_index` is classes.size() for clutter; `shared` are errors of the thing's looks.
  std::vector<float> activations(std::size_t class_index, double size_px,
                                 const Eigen::VectorXd& shared);
  std::pair<double, double> falseExtent(double extent);
  void addClutter(std::vector<std::pair<Detection, int>>& boxes);
  double azimuth(const Eigen::VectorXd& shared, double alpha);

  WorldOptions options_;
  Told told_;
  sim::Dice dice_, elusive_dice_;  ///< its own: what else a seed draws does not depend on it
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
