// Estimation of the lens, and detection of a rig that turns on the body.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/vio/cameras.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/update/visual.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kDrives = 3;

CameraModel lensOf(DistortionModel model, std::vector<double> coefficients) {
  CameraCalibration camera = test::testCamera(0);
  camera.distortion = model;
  camera.distortion_coefficients = std::move(coefficients);
  return CameraModel(camera);
}

TEST(LensError, ItsDerivativeAgreesWithTheNumericOne) {
  const std::vector<CameraModel> cameras = {
      lensOf(DistortionModel::kNone, {}),
      lensOf(DistortionModel::kRadialTangential, {-0.28, 0.07, 1e-3, -2e-3}),
      lensOf(DistortionModel::kEquidistant, {-0.02, 0.01, -0.003, 0.001}),
      lensOf(DistortionModel::kRational, {0.3, -0.1, 1e-3, 1e-3, 0.02, 0.5, 0.1, 0.01})};
  for (const CameraModel& camera : cameras) {
    for (const Vector2d& n : {Vector2d(0.4, -0.3), Vector2d(-0.1, 0.2), Vector2d(0.0, 0.0)}) {
      const auto J = pixelByLens(camera, n);
      for (int i = 0; i < kLensSize; ++i) {
        constexpr double kStep = 1e-6;
        const LensError step = kStep * LensError::Unit(i);
        const Vector2d numeric =
            (withLens(camera, step).distort(n) - withLens(camera, -step).distort(n)) / (2 * kStep);
        EXPECT_LT((numeric - J.col(i)).norm(), 1e-5 * (1.0 + J.col(i).norm())) << i;
      }
    }
  }
}

TEST(LensError, APointFollowsTheLensWithoutTheImage) {
  const CameraModel camera = lensOf(DistortionModel::kRadialTangential, {-0.28, 0.07, 1e-3, -2e-3});
  State state({camera.T_BC()}, 0.0, 3, 3, {}, {.lens = true});
  state.addClone(1, fromNanoseconds(0), Vector3d::Zero(), true,
                 std::make_shared<const std::vector<CameraModel>>(1, camera));
  const ImagePoint seen = *imagePoint(camera, {600.0, 100.0});
  LensError error;
  error << 0.002, 0.5, -0.4, 0.002, -0.001;
  state.lens[0] = error;
  const Vector2d expected = imagePoint(withLens(camera, error), seen.pixel)->normalised;
  const Vector2d moved = normalisedOf(state, state.clones.back(), 0, seen);
  EXPECT_GT((expected - seen.normalised).norm(), 1e-3);
  EXPECT_LT((moved - expected).norm(), 0.01 * (expected - seen.normalised).norm());
}

/// Errors of a rig that is given to the filter, and the filter's deviations for them.
struct WrongRig {
  LensError lens = LensError::Zero();
  double rotation = 0.0;  ///< rad
  double time_offset_s = 0.0;
};

struct Calibrated {
  double position_rms = 0.0;  ///< m, over the last ten seconds
  double nees = 0.0;          ///< of lens, rotation and time offset at the end, per dimension
  double focal = 0.0, rotation = 0.0, offset_s = 0.0;  ///< largest errors at the end
};

TrackedFrame undistortedBy(TrackedFrame frame, const CameraModel& camera) {
  std::erase_if(frame.points, [&](TrackedPoint& p) {
    p.seen[0] = imagePoint(camera, p.seen[0]->pixel);
    return !p.seen[0];
  });
  frame.cameras = std::make_shared<const std::vector<CameraModel>>(1, camera);
  return frame;
}

Calibrated calibrate(const WrongRig& wrong, const Options& options) {
  Calibrated result;
  constexpr double kUntil_s = 40.0;
  for (unsigned seed = 1; seed <= kDrives; ++seed) {
    test::DriveOptions drive_options;
    drive_options.seed = seed;
    test::SimulatedDrive drive(drive_options);
    ImuBuffer imu;
    for (const ImuReading& r : drive.imu(kUntil_s + 1.0)) EXPECT_TRUE(imu.add(r));
    const CameraModel truth = drive.cameras()[0];
    CameraCalibration given = withLens(truth, -wrong.lens).calibration();
    const Vector3d turn = wrong.rotation * Vector3d(0.6, -0.64, 0.48);
    given.T_BC.q = given.T_BC.q * expQuaternion(turn);
    const CameraModel rig(given);
    Estimator estimator(options, {rig.T_BC()}, wrong.time_offset_s);
    estimator.start(test::startAt(drive, 0.2, seed, 1.0));
    std::uint64_t frame = 0;
    int counted = 0;
    double squares = 0.0;
    for (double t = 0.25; t < kUntil_s; t += 0.05) {
      const CameraModel lens = estimator.cameras({rig}).front();
      const auto out = estimator.process(
          {++frame, drive.time(t), undistortedBy(drive.see(t), lens), {}, {}}, imu);
      EXPECT_TRUE(out) << out.error().code;
      if (!out) return result;
      if (t < kUntil_s - 10.0) continue;
      squares += (drive.truth(t).p_WB - out->nav.p_WB).squaredNorm();
      ++counted;
    }
    result.position_rms += std::sqrt(squares / counted) / kDrives;
    const State& state = estimator.state();
    const Vector3d left = logSo3(state.T_BC[0].q.conjugate() * truth.T_BC().q);
    const LensError lens = wrong.lens - state.lens[0];
    result.rotation = std::max(result.rotation, left.norm());
    result.focal = std::max(result.focal, std::abs(lens[0]));
    result.offset_s = std::max(result.offset_s, std::abs(state.time_offset_s));
    Eigen::VectorXd e(9);
    const int at = state.camera(0).at;
    std::vector<Block> blocks{{at, 3}, {state.timeOffsetAt(), 1}};
    e.head<4>() << left, -state.time_offset_s;
    if (const auto lens_at = state.lensAt(0)) {
      blocks.push_back({*lens_at, kLensSize});
      e.tail<kLensSize>() = lens;
    } else {
      e.conservativeResize(4);
    }
    result.nees += squaredMahalanobis(e, state.covarianceOf(blocks)) /
                   (static_cast<double>(e.size()) * kDrives);
  }
  std::printf("position %.4f m, focal %.4f, rotation %.4f rad, offset %.5f s, NEES %.2f\n",
              result.position_rms, result.focal, result.rotation, result.offset_s, result.nees);
  return result;
}

Options approximate() {
  Options options;
  options.calibration.focal = 0.05;
  options.calibration.extrinsic_rotation = 0.05;
  options.calibration.time_offset_s = 0.02;
  return options;
}

const Calibrated& ofExactRig() {
  static const Calibrated exact = calibrate({}, Options{});
  return exact;
}

TEST(SelfCalibration, AWrongRigIsCorrectedAsFarAsItsDeviationsSay) {
  WrongRig wrong;
  wrong.lens << 0.05, 4.0, -3.0, 0.02, -0.01;
  wrong.rotation = 3.0 * M_PI / 180.0;
  wrong.time_offset_s = 0.02;
  const Calibrated corrected = calibrate(wrong, approximate());
  EXPECT_LT(corrected.focal, 0.005);
  EXPECT_LT(corrected.rotation, 0.005);
  EXPECT_LT(corrected.offset_s, 0.001);
  EXPECT_LT(corrected.position_rms, 1.3 * ofExactRig().position_rms + 0.02);
  EXPECT_LT(corrected.nees, 10.0);
}

TEST(SelfCalibration, ARightRigIsNotMadeWorse) {
  EXPECT_LT(calibrate({}, approximate()).position_rms, 1.3 * ofExactRig().position_rms + 0.02);
}

TEST(RigDeviations, ReplaceDefaultsAndNotTheUsersValues) {
  CalibrationOptions options;
  options.time_offset_s = 0.04;
  useDeviations({.focal = 0.01, .rotation = 0.02, .time_offset_s = 0.003}, options);
  EXPECT_EQ(options.focal, 0.01);
  EXPECT_TRUE(options.estimated().lens);
  EXPECT_EQ(options.extrinsic_rotation, 0.02);
  EXPECT_EQ(options.time_offset_s, 0.04);
  EXPECT_EQ(options.centre_px, CalibrationOptions().centre_px) << "not known";
}

struct Turned {
  int noticed = 0;        ///< runs in which a turn was reported
  double latest_s = 0.0;  ///< longest time until then
  double rotation = 0.0;  ///< rad, largest error of the rotation at the end
  double nees = 0.0;      ///< of the pose at the end, per dimension
};

Turned driveWith(test::DriveOptions drive_options, const Options& options = {}) {
  Turned result;
  constexpr double kFrom = 12.025, kUntil_s = 42.0;
  drive_options.mount_from_s = kFrom;
  if (drive_options.jump_from_s < kUntil_s) drive_options.jump_from_s = kFrom;
  for (unsigned seed = 1; seed <= kDrives; ++seed) {
    drive_options.seed = seed;
    test::SimulatedDrive drive(drive_options);
    ImuBuffer imu;
    for (const ImuReading& r : drive.imu(kUntil_s + 1.0)) EXPECT_TRUE(imu.add(r));
    Estimator estimator(options, drive.T_BC(), 0.0);
    estimator.start(test::startAt(drive, 0.2, seed, 1.0));
    std::uint64_t frame = 0;
    bool noticed = false;
    for (double t = 0.25; t < kUntil_s; t += 0.05) {
      const auto out = estimator.process({++frame, drive.time(t), drive.see(t), {}, {}}, imu);
      EXPECT_TRUE(out) << out.error().code;
      if (!out) return result;
      if (estimator.mountTurn() && !noticed) {
        noticed = true;
        result.latest_s = std::max(result.latest_s, t - kFrom);
      }
      if (t < kUntil_s - 0.06) continue;
      Eigen::Matrix<double, 6, 1> e;
      e << logSo3(out->nav.q_WB.conjugate() * drive.truth(t).q_WB),
          drive.truth(t).p_WB - out->nav.p_WB;
      result.nees += squaredMahalanobis(e, out->covariance.topLeftCorner<6, 6>()) / (6.0 * kDrives);
    }
    result.noticed += noticed;
    const Eigen::Quaterniond truth = drive_options.mount.q * drive.T_BC()[0].q;
    const Vector3d left = logSo3(estimator.state().T_BC[0].q.conjugate() * truth);
    result.rotation = std::max(result.rotation, left.norm());
  }
  std::printf("noticed %d of %d after at most %.2f s, rotation %.4f rad, NEES %.2f\n",
              result.noticed, kDrives, result.latest_s, result.rotation, result.nees);
  return result;
}

TEST(Mount, ATurnOfTheCameraByADegreeIsReportedAndFollowed) {
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    test::DriveOptions options;
    options.mount.q = expQuaternion(M_PI / 180.0 * axis);
    const Turned turned = driveWith(options);
    EXPECT_EQ(turned.noticed, kDrives) << axis.transpose();
    EXPECT_LT(turned.latest_s, 30.0);
    EXPECT_LT(turned.rotation, 0.004);
    EXPECT_LT(turned.nees, 5.0);
  }
}

TEST(Mount, ThatIsNotEstimatedStaysAsItIsIfImagesJump) {
  Options exact;
  exact.calibration.estimate_extrinsics = false;
  test::DriveOptions options;
  options.mount.q = expQuaternion(M_PI / 180.0 * Vector3d(0, 1, 0));
  const Turned turned = driveWith(options, exact);
  EXPECT_EQ(turned.noticed, 0);
  EXPECT_NEAR(turned.rotation, M_PI / 180.0, 1e-9);
}

TEST(Mount, ABodyThatIsMovedIsNoTurnOfTheCamera) {
  test::DriveOptions options;
  options.jump = RigidTransform(Eigen::Quaterniond::Identity(), {0.1, -0.08, 0.06});
  options.jump_from_s = 12.025;
  EXPECT_EQ(driveWith(options).noticed, 0);
}

}  // namespace
}  // namespace perdure::vio
