#include "common/replay/files/pose_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "common/math/so3.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

using ::testing::HasSubstr;

PoseFile readPoses(const std::string& text) {
  const auto file = freshFolder("poses") / "poses.txt";
  writeText(file, text);
  return PoseFile::read(file);
}
std::string errorOfPoses(const std::string& text) {
  return startupErrorOf([&] { readPoses(text); });
}
TimePoint at(double seconds) { return TimePoint(durationFromSeconds(seconds)); }

TEST(PoseFile, TumTimesAreExactToTheNanosecond) {
  const auto poses = readPoses("# t x y z q\n1403715273.262142976 1 2 3 0 0 0 1\n");
  EXPECT_EQ(poses.format(), PoseFormat::kTum);
  EXPECT_EQ(toNanoseconds(poses.poses()[0].time), 1403715273262142976);
  EXPECT_TRUE(poses.poses()[0].T_WB.p.isApprox(Eigen::Vector3d(1, 2, 3)));
}

TEST(PoseFile, TumPosesAreInterpolatedBetweenCloseNeighboursOnly) {
  const auto poses = readPoses(
      "0 0 0 0 0 0 0 1\n"
      "0.4 4 0 0 0 0 0.70710678 0.70710678\n"
      "9 9 0 0 0 0 0 1\n");
  const auto half = poses.at(0, at(0.2));
  ASSERT_TRUE(half);
  EXPECT_NEAR(half->p.x(), 2.0, 1e-12);
  EXPECT_NEAR(yawOf(half->R()), std::numbers::pi / 4, 1e-6);
  EXPECT_FALSE(poses.at(0, at(5.0))) << "the neighbours are 8.6 s apart";
  EXPECT_FALSE(poses.at(0, at(-0.1)));
  EXPECT_FALSE(poses.at(0, at(9.1)));
  EXPECT_TRUE(poses.at(0, at(9.0005))) << "within a millisecond it is the same time";
}

TEST(PoseFile, LinesOfOtherProgramsAreReadWhereTheirMeaningIsSure) {
  const std::string names = "timestamp tx ty tz qx qy qz qw\n", line = "1.5 1 2 3 0 0 0 1\n";
  std::string with_commas = names + line, with_semicolons = names + line;
  std::replace(with_commas.begin(), with_commas.end(), ' ', ',');
  std::replace(with_semicolons.begin(), with_semicolons.end(), ' ', ';');
  for (const std::string& text :
       {names + line, "#" + names + line, "# " + names + line, "\xEF\xBB\xBF" + line,
        "\xEF\xBB\xBF" + names + line, names + "1.5 1 2 3 0 0 0 1\r\n", with_commas,
        with_semicolons, std::string("1.5\t1\t2\t3\t0\t0\t0\t1\n"),
        std::string("1.5, 1, 2, 3, 0, 0, 0, 1,\n")}) {
    EXPECT_EQ(errorOfPoses(text), "") << text;
    const auto poses = readPoses(text).poses();
    ASSERT_EQ(poses.size(), 1U) << text;
    EXPECT_EQ(poses[0].time, at(1.5)) << text;
    EXPECT_TRUE(poses[0].T_WB.p.isApprox(Eigen::Vector3d(1, 2, 3))) << text;
    EXPECT_TRUE(poses[0].T_WB.R().isIdentity()) << text;
  }
  const std::string kitti =
      "r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz\n1 0 0 4 0 1 0 5 0 0 1 6\n";
  EXPECT_EQ(readPoses(kitti).at(0, at(0))->p.z(), 6.0);
}

TEST(PoseFile, AHeaderThatNamesWFirstIsBelieved) {
  for (const char* names :
       {"t,x,y,z,qw,qx,qy,qz", "#t, px, py, pz, q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"}) {
    const auto poses = readPoses(std::string(names) + "\n1,0,0,0,1,0,0,0\n").poses();
    EXPECT_TRUE(poses.at(0).T_WB.R().isIdentity()) << names;
  }
}

TEST(PoseFile, ColumnsAreTakenByTheNamesOfAHeader) {
  for (const char* text :
       {"timestamp,qx,qy,qz,qw,tx,ty,tz\n1.5,0,0,0,1,1,2,3\n",
        "tx ty tz qx qy qz qw timestamp\n1 2 3 0 0 0 1 1.5\n",
        ",timestamp,tx,ty,tz,qx,qy,qz,qw\n0,1.5,1,2,3,0,0,0,1\n",
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
        "q_RS_z [], v_RS_R_x [m s^-1], b_w_RS_S_x [rad s^-1]\n1500000000,1,2,3,1,0,0,0,9,9\n",
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,"
        "field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
        "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w\n"
        "1600000000,0,1500000000,map,1,2,3,0,0,0,1\n"}) {
    EXPECT_EQ(errorOfPoses(text), "") << text;
    const auto poses = readPoses(text).poses();
    ASSERT_EQ(poses.size(), 1U) << text;
    EXPECT_EQ(poses[0].time, at(1.5)) << text;
    EXPECT_TRUE(poses[0].T_WB.p.isApprox(Eigen::Vector3d(1, 2, 3))) << text;
    EXPECT_TRUE(poses[0].T_WB.R().isIdentity()) << text;
  }
  EXPECT_THAT(errorOfPoses("t,x,y,z,x,qx,qy,qz,qw\n1,0,0,0,0,0,0,0,1\n"), HasSubstr("9 numbers"))
      << "two columns are x";
}

TEST(PoseFile, AnglesAreNoQuaternions) {
  for (const char* text : {"t,x,y,z,roll,pitch,yaw,valid\n1,0,0,0,0.1,0,0,1\n",
                           "# t x y z roll_deg pitch_deg yaw_deg\n1 0 0 0 0.1 0 0\n"}) {
    EXPECT_THAT(errorOfPoses(text), HasSubstr(":2: the header names angles (roll, pitch, yaw)"));
  }
  EXPECT_EQ(errorOfPoses("# roll and yaw are free\n1 0 0 0 0 0 0 1\n"), "");
  // A comment with as many words as columns is not a header if no word is a time.
  EXPECT_EQ(errorOfPoses("# roll pitch yaw were turned to quaternions here\n1 0 0 0 0 0 0 1\n"),
            "");
}

TEST(PoseFile, FilesThatAreNoTableOfPosesAreNamed) {
  EXPECT_THAT(errorOfPoses("[{\"t\": 1.0, \"p\": [1, 2, 3]}]\n"), HasSubstr(":1: this is JSON"));
  EXPECT_THAT(errorOfPoses("# Image list:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, "
                           "NAME\n1 1 0 0 0 1 2 3 1 a.png\n"),
              HasSubstr(":2: this is COLMAP's images.txt"));
  EXPECT_THAT(errorOfPoses("1 1 0 0 0 1 2 3 1 a.png\n"), HasSubstr("this is COLMAP's images.txt"));
}

TEST(PoseFile, OneHeaderIsNoneOfManyLinesOfWords) {
  EXPECT_THAT(errorOfPoses("hello world\nhello world\n"), HasSubstr(":2: 2 numbers; write 8"));
  EXPECT_THAT(errorOfPoses("nan nan nan nan nan nan nan nan\n"),
              HasSubstr(":1: write eight finite numbers"));
  EXPECT_THAT(errorOfPoses("1 nan nan nan nan nan nan nan\n"),
              HasSubstr("leave out a line whose pose is not known"));
}

TEST(PoseFile, NanosecondsAreToldToBeNoSeconds) {
  EXPECT_THAT(errorOfPoses("1403715273262142976 0 0 0 0 0 0 1\n"),
              HasSubstr(":1: the time 1403715273262142976 is not in seconds; where it is in "
                        "nanoseconds, divide it by 1000000000"));
}

TEST(PoseFile, AnEmptyLineAmongKittisIsNamedSinceItWouldShiftTheOthers) {
  const std::string pose = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  EXPECT_THAT(errorOfPoses(pose + "\n" + pose), HasSubstr("poses.txt:2: the line is empty"));
  EXPECT_EQ(readPoses("# a comment\n\n" + pose + pose + "\n\n").poses().size(), 2U);
  const std::string tum = " 0 0 0 0 0 0 1\n";
  EXPECT_EQ(readPoses("1" + tum + "\n2" + tum).poses().size(), 2U) << "lines with a time may";
}

TEST(PoseFile, KittiLinesOfTwelveAndSixteenNumbersAreByFrame) {
  for (const char* last_row : {"", " 0 0 0 1"}) {
    const std::string rows = std::string("1 0 0 0 0 1 0 0 0 0 1 0") + last_row +
                             "\n0 -1 0 5 1 0 0 6 0 0 1 7" + last_row + "\n";
    const auto poses = readPoses(rows);
    EXPECT_EQ(poses.format(), PoseFormat::kKitti);
    const auto second = poses.at(1, at(77));
    ASSERT_TRUE(second);
    EXPECT_TRUE(second->p.isApprox(Eigen::Vector3d(5, 6, 7)));
    EXPECT_NEAR(yawOf(second->R()), std::numbers::pi / 2, 1e-12);
    EXPECT_FALSE(poses.at(2, at(0)));
  }
}

TEST(PoseFile, WrongLinesAreWrongDataAndNoFileThatIsMissing) {
  for (const char* text : {"0 0 0 nan 0 0 0 1\n", "0 0 0 x 0 0 0 1\n", "1 2 3\n", "", "# none\n"}) {
    EXPECT_EQ(startupCodeOf([&] { readPoses(text); }), ExitCode::kData) << text;
  }
  EXPECT_EQ(startupCodeOf([] { PoseFile::read("/nowhere.txt"); }), ExitCode::kUnavailable);
}

TEST(PoseFile, EveryWrongLineIsLocated) {
  EXPECT_THAT(errorOfPoses("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 0.5\n"),
              HasSubstr("poses.txt:2: the quat"));
  EXPECT_THAT(errorOfPoses("1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n"),
              HasSubstr(":2: the time does not"));
  EXPECT_THAT(errorOfPoses("1 0 0 0 0 2 0 0 0 0 1 0\n"), HasSubstr(":1: the rotation"));
  EXPECT_THAT(errorOfPoses("1 0 0 0 0 1 0 0 0 0 -1 0\n"), HasSubstr("right-handed"));
  EXPECT_THAT(errorOfPoses("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\n"), HasSubstr("0 0 0 1"));
  EXPECT_THAT(errorOfPoses("0 0 0 nan 0 0 0 1\n"), HasSubstr(":1: write eight finite numbers"));
  EXPECT_THAT(errorOfPoses("-9223372036854775808.5 0 0 0 0 0 0 1\n"), HasSubstr(":1: the time"));
  EXPECT_THAT(errorOfPoses("1e300 0 0 0 -1e300 1 0 0 0 0 1 0\n"), HasSubstr(":1: the rotation"));
  EXPECT_THAT(errorOfPoses("1 2 3\n"), HasSubstr(":1: 3 numbers; write 8"));
  EXPECT_THAT(errorOfPoses("0 0 0 0 0 0 0 1\n1 0 0 0\n"), HasSubstr(":2: 4 numbers"));
  EXPECT_THAT(errorOfPoses("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"),
              HasSubstr("the time is that of the line before; leave one of them out"));
  EXPECT_THAT(errorOfPoses("# nothing\n"), HasSubstr("holds no poses"));
  EXPECT_THAT(startupErrorOf([] { PoseFile::read("/nowhere.txt"); }), HasSubstr("--odometry"));
}

FrameStamp frameAt(std::uint64_t frame, double seconds = 0.0) {
  FrameStamp stamp;
  stamp.sequence = frame;
  stamp.time = at(seconds);
  return stamp;
}

constexpr char kVariances[] = "step_x_x step_y_y step_z_z step_rx_rx step_ry_ry step_rz_rz";

TEST(PoseFile, CovariancesOfStepsAreReadByTheNamesOfTheirColumns) {
  const std::string names = kVariances, values = " 4 5 6 1 2 3 ";
  const Matrix6d expected =
      (Eigen::Matrix<double, 6, 1>() << 1, 2, 3, 4, 5, 6).finished().asDiagonal();
  for (const std::string& text :
       {"# t x y z qx qy qz qw " + names + "\n0 0 0 0 0 0 0 1" + values + "\n1 0 0 0 0 0 0 1" +
            values + "\n",
        names + " t x y z qx qy qz qw\n" + values + "0 0 0 0 0 0 0 1\n" + values +
            "1 0 0 0 0 0 0 1\n",
        "# R11 R12 R13 x R21 R22 R23 y R31 R32 R33 z " + names + "\n1 0 0 0 0 1 0 0 0 0 1 0" +
            values + "\n1 0 0 0 0 1 0 0 0 0 1 0" + values + "\n"}) {
    const auto poses = readPoses(text);
    ASSERT_TRUE(poses.hasSteps()) << text;
    EXPECT_EQ(poses.errorOfSteps(frameAt(0, 0), frameAt(1, 1)), expected) << text;
  }
  const auto poses = readPoses("# t x y z qx qy qz qw step_rz_x " + names + "\n0 0 0 0 0 0 0 1 0" +
                               values + "\n1 0 0 0 0 0 0 1 -1.5" + values + "\n");
  EXPECT_EQ(poses.errorOfSteps(frameAt(0, 0), frameAt(1, 1))(2, 3), -1.5);
  EXPECT_EQ(poses.errorOfSteps(frameAt(0, 0), frameAt(1, 1))(3, 2), -1.5);
  EXPECT_FALSE(readPoses("# covariance left out\n0 0 0 0 0 0 0 1\n").hasSteps());
}

TEST(PoseFile, WrongCovariancesOfStepsAreLocated) {
  const std::string pose = "t x y z qx qy qz qw ", names = kVariances, line = "0 0 0 0 0 0 0 1 ";
  EXPECT_THAT(errorOfPoses("# " + pose + names + "\n" + line + "1 1 1 1 1\n"),
              HasSubstr("poses.txt:2: 13 columns, but the header names 14"));
  EXPECT_THAT(
      errorOfPoses("# " + pose + names + "\n" + line + "1 1 1 1 1 -0.5\n"),
      HasSubstr(":2: the step's covariance is not positive semi-definite (least variance -0.5"));
  EXPECT_THAT(errorOfPoses("# " + pose + names + "\n" + line + "1 1 1 1 1 x\n"),
              HasSubstr(":2: x: an entry of the step's covariance is not a number"));
  EXPECT_THAT(errorOfPoses("# " + pose + names + " step_x_rz\n" + line + "1 1 1 1 1 4 2\n"), "");
  EXPECT_THAT(errorOfPoses("# " + pose + names + " step_x_rz\n" + line + "1 1 1 1 1 4 2.1\n"),
              HasSubstr(":2: the step's covariance is not positive semi-definite"));
  EXPECT_THAT(errorOfPoses("# " + pose + names + " step_x_yaw\n" + line + "1 1 1 1 1 4 0\n"),
              HasSubstr(":1: step_x_yaw: write step_A_B"));
  EXPECT_THAT(
      errorOfPoses("# " + pose + names + " step_x_y step_y_x\n" + line + "1 1 1 1 1 4 0 0\n"),
      HasSubstr(":1: step_y_x: this entry of the symmetric covariance is named twice"));
  EXPECT_THAT(errorOfPoses("# " + pose + names + " step_x_y\n" + line + "0 1 1 1 1 1 0.1\n"),
              HasSubstr(":2: the step's covariance is not positive semi-definite"));
  EXPECT_THAT(errorOfPoses("# " + pose + "STEP_X_X\n" + line + "1\n"),
              HasSubstr(":1: STEP_X_X: write step_A_B"));
  EXPECT_THAT(errorOfPoses("# " + pose + "step_xx step_yy\n" + line + "1 1\n"),
              HasSubstr(":1: step_xx: write step_A_B"));
  EXPECT_THAT(
      errorOfPoses("0 " + line.substr(2) + "\n# " + pose + names + "\n" + line + "1 1 1 1 1 1\n"),
      HasSubstr(":2: a header with step_A_B must stand before the first pose"));
  EXPECT_THAT(errorOfPoses("# " + pose + "step_x_x\n" + line + "1\n"),
              HasSubstr(":1: the step's covariance needs the six variances"));
  EXPECT_THAT(errorOfPoses(line + "1 1 1 1 1 1\n"), HasSubstr("in a header"));
}

/// Error [θ, p] of the last pose if the step to pose k has the error `step`, by composition.
Eigen::Matrix<double, 6, 1> errorAfter(const std::vector<StampedPose>& poses, std::size_t k,
                                       const Eigen::Matrix<double, 6, 1>& step) {
  const RigidTransform& last = poses.back().T_WB;
  const RigidTransform error(expQuaternion(step.head<3>()), Eigen::Vector3d(step.tail<3>()));
  const RigidTransform moved = poses[k].T_WB * error * (poses[k].T_WB.inverse() * last);
  Eigen::Matrix<double, 6, 1> result;
  result << logSo3(Eigen::Quaterniond(last.q.conjugate() * moved.q)), moved.p - last.p;
  return result;
}

TEST(PoseFile, TheErrorOfSeveralStepsIsThatOfTheirComposition) {
  std::vector<StampedPose> poses(4);
  std::vector<Matrix6d> steps(4);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double k = static_cast<double>(i);
    poses[i].T_WB = RigidTransform(expQuaternion({0.1 * k, -0.2, 0.4 * k}),
                                   Eigen::Vector3d(5.0 * k, 0.3 * k * k, -0.2 * k));
    const Matrix6d A = Matrix6d::Identity() + 0.05 * k * Matrix6d::Ones();
    steps[i] = 1e-4 * A * A.transpose();
  }
  Matrix6d expected = Matrix6d::Zero();
  for (std::size_t k = 1; k < poses.size(); ++k) {
    Matrix6d J;
    constexpr double kStep = 1e-6;
    for (int i = 0; i < 6; ++i) {
      const Eigen::Matrix<double, 6, 1> d = kStep * Matrix6d::Identity().col(i);
      J.col(i) = (errorAfter(poses, k, d) - errorAfter(poses, k, -d)) / (2.0 * kStep);
    }
    expected += J * steps[k] * J.transpose();
  }
  const PoseFile file(PoseFormat::kKitti, poses, steps);
  EXPECT_TRUE(file.errorOfSteps(frameAt(0), frameAt(3)).isApprox(expected, 1e-7));
}

TEST(PoseFile, AFrameBetweenTwoPosesHasItsShareOfTheStep) {
  std::vector<StampedPose> poses(3);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].time = at(0.1 * static_cast<double>(i));
  const std::vector<Matrix6d> steps{Matrix6d::Identity(), 2.0 * Matrix6d::Identity(),
                                    5.0 * Matrix6d::Identity()};
  const PoseFile file(PoseFormat::kTum, poses, steps);
  const auto between = [&](double a, double b) {
    return file.errorOfSteps(frameAt(0, a), frameAt(0, b))(0, 0);
  };
  EXPECT_NEAR(between(0.0, 0.05), 1.0, 1e-9);
  EXPECT_NEAR(between(0.025, 0.05), 0.5, 1e-9);
  EXPECT_NEAR(between(0.05, 0.12), 1.0 + 1.0, 1e-9);
  EXPECT_NEAR(between(0.0, 0.2), 7.0, 1e-9);
}

}  // namespace
}  // namespace perdure::replay
