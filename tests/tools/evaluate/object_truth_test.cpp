#include "tools/evaluate/object_truth.h"

#include <gtest/gtest.h>

namespace perdure::tools {
namespace {

replay::KittiLabel car(std::uint64_t frame, std::int64_t track, const Eigen::Vector3d& centre) {
  replay::KittiLabel label;
  label.frame = frame;
  label.track = track;
  label.type = "Car";
  label.centre = centre;
  label.box = Box{100, 100, 150, 130};
  return label;
}

/// The body moves along z by one metre per frame; rectified camera and body have the same pose.
PosesByFrame drive(std::uint64_t frames) {
  PosesByFrame poses;
  for (std::uint64_t i = 0; i < frames; ++i) {
    poses[i] = RigidTransform(Eigen::Quaterniond::Identity(),
                              Eigen::Vector3d(0, 0, static_cast<double>(i)));
  }
  return poses;
}

TEST(ObjectTruth, ATrackIsStaticInTheWorldNotInTheCamera) {
  std::vector<replay::KittiLabel> labels;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const double z = static_cast<double>(i);
    labels.push_back(car(i, 1, {2, 1, 30 - z}));                       // parked
    labels.push_back(car(i, 2, {-2, 1, 20}));                          // drives ahead at the body's
                                                                       // speed
    labels.push_back(car(i, 3, {4, 1, 30 - 0.88 * z}));                // moves by 2.3 m
    labels.push_back(car(i, 4, {6, 1, 30 - z + (i == 9 ? 2.5 : 0)}));  // parked, with one outlier
  }
  EXPECT_EQ(staticTracks(labels, RigidTransform(), drive(20)), (std::set<std::int64_t>{1}));
}

TEST(ObjectTruth, FramesWithoutAPoseAreLeftOut) {
  std::vector<replay::KittiLabel> labels;
  for (std::uint64_t i = 0; i < 10; ++i) {
    labels.push_back(car(i, 1, {2, 1, 30 - static_cast<double>(i)}));
    labels.push_back(car(i + 100, 2, {2, 1, 30}));
  }
  EXPECT_EQ(staticTracks(labels, RigidTransform(), drive(10)), (std::set<std::int64_t>{1}));
}

TEST(ObjectTruth, OnlyWholeUnoccludedTallStaticCarsCount) {
  std::vector<replay::KittiLabel> labels(6, car(0, 1, {0, 1, 20}));
  labels[1].occluded = 1;
  labels[2].truncated = 1;
  labels[3].box.y2 = labels[3].box.y1 + 24.9;
  labels[4].type = "Van";
  labels[5].track = 2;
  labels.push_back(car(0, -1, {0, 0, 0}));
  labels.back().type = "DontCare";
  const auto frames = sortTruth(labels, {1});
  EXPECT_EQ(frames.at(0).counted.size(), 1U);
  EXPECT_EQ(frames.at(0).ignored.size(), 5U);
  EXPECT_EQ(frames.at(0).dont_care.size(), 1U);
}

}  // namespace
}  // namespace perdure::tools
