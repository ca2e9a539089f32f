#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/tools/outputs/pixels.h"
#include "tests/tools/outputs/scene.h"
#include "tools/outputs/pictures/map_legend.h"

namespace perdure::tools {
namespace {

MapContent street(double length = 60.0) {
  MapContent content;
  for (double x = 0.0; x <= length; x += 1.0) content.path.emplace_back(x, 0.0, 1.0);
  content.objects = {objectAt(1, {20, 6, 0.7}),
                     objectAt(2, {40, 6, 0.7}, Visibility::kOccluded, "van"),
                     objectAt(3, {30, -6, 0.7}, Visibility::kOutOfView, "person")};
  return content;
}

TruthTrack trackAt(const Eigen::Vector3d& centre) {
  TruthTrack track;
  track.size = {4.0, 2.0, 1.5};
  track.keys.push_back({{}, centre, 0.0});
  return track;
}

/// Coverage of the long lower side of the outline, for an object that heads along x.
double sideCoverage(const MapContent& content, const ObjectGlance& object) {
  const MapView view = viewOf(content);
  const Eigen::Vector2d p = object.p_W.head<2>();
  return coverage(drawMap(content, view), view.at(p + Eigen::Vector2d(-1.9, -1.0)),
                  view.at(p + Eigen::Vector2d(1.9, -1.0)), classColour(object.class_name));
}

TEST(MapPicture, OutlinesAreUnbrokenInTheClassesColourAndHiddenOnesHaveGaps) {
  const MapContent content = street();
  EXPECT_EQ(sideCoverage(content, content.objects[0]), 1.0);
  EXPECT_EQ(sideCoverage(content, content.objects[2]), 1.0);
  EXPECT_GT(sideCoverage(content, content.objects[1]), 0.4);
  EXPECT_LT(sideCoverage(content, content.objects[1]), 0.95);
}

TEST(MapPicture, WhatIsInSightIsFilledWhatIsOutOfViewPalelyAndWhatIsHiddenIsNot) {
  const MapContent content = street();
  const MapView view = viewOf(content);
  const cv::Mat picture = drawMap(content, view);
  const auto inside = [&](const ObjectGlance& o) {  // away from the line that shows the heading
    return picture.at<cv::Vec3b>(view.at(o.p_W.head<2>() + Eigen::Vector2d(-1.0, 0.5)));
  };
  EXPECT_LT(apart(inside(content.objects[0]), mixed(classColour("car"), kPaper, 0.35)), 8.0);
  EXPECT_LT(apart(inside(content.objects[1]), kPaper), 2.0);
  EXPECT_LT(apart(inside(content.objects[2]), mixed(classColour("person"), kPaper, 0.8)), 8.0);
}

TEST(MapPicture, TheTruthHasItsColourWhereItIsAndNowhereElse) {
  MapContent content = street();
  const MapView without = viewOf(content);
  EXPECT_EQ(count(drawMap(content, without), kTruthColour, 30.0), 0);
  content.truth.emplace();
  content.truth->objects = {trackAt({21, 6.5, 0.7})};
  const MapView view = viewOf(content);
  const cv::Mat picture = drawMap(content, view);
  EXPECT_EQ(coverage(picture, view.at({19.1, 7.5}), view.at({22.9, 7.5}), kTruthColour, 130.0),
            1.0);
  EXPECT_TRUE(hasColour(picture, view.at({21, 6.5}), kTruthColour));
  const cv::Rect around(cv::Point(view.at({18, 9})), cv::Point(view.at({24, 4})));
  cv::Mat(picture, around).setTo(kPaper);
  EXPECT_EQ(count(picture(view.area), kTruthColour, 30.0), 0);
}

TEST(MapPicture, TruthThatWasTakenAwayIsNotThereAtTheEnd) {
  MapContent content = street();
  content.end = fromNanoseconds(60'000'000'000);
  content.truth.emplace();
  content.truth->objects = {trackAt({21, 6.5, 0.7})};
  content.truth->objects[0].present_until = fromNanoseconds(30'000'000'000);
  const MapView view = viewOf(content);
  const cv::Mat picture = drawMap(content, view);
  EXPECT_EQ(count(picture(view.area), kTruthColour, 30.0), 0);
}

TEST(MapPicture, TheScaleBarIsAsLongAsItSays) {
  for (const double length : {4.0, 60.0, 700.0}) {
    const MapContent content = street(length);
    const MapView view = viewOf(content);
    const cv::Mat picture = drawMap(content, view);
    int run = 0;
    while (apart(picture.at<cv::Vec3b>(view.bar.y + 1, view.bar.x + run), kInk) < 2) ++run;
    EXPECT_NEAR(run, view.bar_m * view.scale, 1.0) << length;
    EXPECT_GT(run, 60);
    EXPECT_LT(apart(picture.at<cv::Vec3b>(view.bar.y + 1, view.bar.x - 3), kPaper), 40);
  }
}

TEST(MapPicture, RoomsStreetsAndLongDrivesFitIntoPicturesThatCanBeRead) {
  for (const double length : {3.0, 60.0, 1000.0, 4000.0}) {
    const MapContent content = street(length);
    const MapView view = viewOf(content);
    const cv::Size size = drawMap(content, view).size();
    EXPECT_LE(std::max(view.area.width, view.area.height), 4001) << length;
    EXPECT_GE(view.area.width, 350) << length;
    EXPECT_LE(view.scale, 60.0);
    if (length <= 900.0) {
      EXPECT_GE(view.scale, 4.0) << "a car of 4 m is 16 pixels";
    }
    EXPECT_GE(view.area.x, 0);
    EXPECT_GT(size.width, view.area.br().x);
    EXPECT_GT(size.height, view.area.br().y);
    for (const auto& p : content.path) {
      EXPECT_TRUE(view.area.contains(cv::Point(view.at(p.head<2>()))));
    }
  }
}

TEST(MapPicture, AStrayObjectFarFromTheWayDoesNotShrinkTheMap) {
  MapContent content = street();
  const double scale = viewOf(content).scale;
  content.objects.push_back(objectAt(9, {0, 900, 0}));
  const MapView view = viewOf(content);
  EXPECT_DOUBLE_EQ(view.scale, scale);
  EXPECT_FALSE(drawMap(content, view).empty());
  MapContent room = street(4.0);
  for (auto& object : room.objects) object.p_W = {1.0, 1.5, 0.0};
  const double room_scale = viewOf(room).scale;
  room.objects.push_back(objectAt(9, {0, 25, 0}));
  EXPECT_DOUBLE_EQ(viewOf(room).scale, room_scale) << "25 m are far in a room";
}

TEST(MapPicture, NothingIsDrawnBeyondTheMapsBorder) {
  MapContent content = street();
  const MapView view = viewOf(content);
  const cv::Mat before = drawMap(content, view);
  for (const double y : {-400.0, 400.0}) content.path.emplace_back(30, y, 0);
  const cv::Mat after = drawMap(content, view);
  EXPECT_EQ(cv::norm(before.rowRange(0, view.area.y), after.rowRange(0, view.area.y)), 0.0);
  EXPECT_EQ(cv::norm(before.rowRange(view.area.br().y, before.rows),
                     after.rowRange(view.area.br().y, before.rows)),
            0.0);
  EXPECT_GT(cv::norm(before(view.area), after(view.area)), 100.0);
}

TEST(MapPicture, TheEllipseIsTwoSigmaInEachDirection) {
  MapContent content = street();
  content.objects[2].p_covariance.diagonal() << 9.0, 1.0, 1.0;
  const MapView view = viewOf(content);
  const cv::Mat picture = drawMap(content, view);
  const Colour colour = mixed(classColour("person"), kPaper, 0.35);
  const Eigen::Vector2d p = content.objects[2].p_W.head<2>();
  for (const auto& way : {Eigen::Vector2d(6, 0), Eigen::Vector2d(-6, 0), Eigen::Vector2d(0, 2),
                          Eigen::Vector2d(0, -2)}) {
    EXPECT_TRUE(hasColour(picture, view.at(p + way), colour, 1, 40.0)) << way.transpose();
    EXPECT_FALSE(hasColour(picture, view.at(p + 1.3 * way), colour, 1, 40.0)) << way.transpose();
  }
}

TEST(MapPicture, LandmarksAreDotsAndThoseOutsideAreLeftOut) {
  MapContent content = street();
  const MapView view = viewOf(content);
  content.landmarks = {{10.f, 3.f, 0.f}, {1e5f, 3.f, 0.f}};
  const cv::Mat picture = drawMap(content, view);
  EXPECT_TRUE(hasColour(picture, view.at({10, 3}), kDots, 0, 2.0));
}

TEST(MapPicture, AnchorsAreRingsAndLoopsLinesBrokenWhereTheyAreNotBelieved) {
  MapContent content = street();
  content.anchors = {{10, 0, 1}, {50, 0, 1}};
  content.loops = {{{5, 3, 0}, {15, 3, 0}, true}, {{25, 3, 0}, {35, 3, 0}, false}};
  const MapView view = viewOf(content);
  const cv::Mat picture = drawMap(content, view);
  EXPECT_TRUE(hasColour(picture, view.at({10, 0}), kPaper, 0, 12.0));
  EXPECT_TRUE(hasColour(picture, view.at({20, 0}), kInk, 1, 30.0)) << "the way between them";
  const Colour believed = loopStroke(true, 1.0).colour, doubted = loopStroke(false, 1.0).colour;
  EXPECT_EQ(coverage(picture, view.at({5.5, 3}), view.at({14.5, 3}), believed), 1.0);
  const double dashes = coverage(picture, view.at({25.5, 3}), view.at({34.5, 3}), doubted);
  EXPECT_GT(dashes, 0.4);
  EXPECT_LT(dashes, 0.95);
  EXPECT_GT(pictureSize(content, view).height, pictureSize(street(), view).height - 1);
}

TEST(MapPicture, NothingIsWrittenWhereThereIsNothing) {
  const std::string file = ::testing::TempDir() + "/perdure_empty_map.png";
  std::filesystem::remove(file);
  EXPECT_FALSE(writeMap({}, file));
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_TRUE(writeMap(street(), file));
  EXPECT_EQ(cv::imread(file).size(), drawMap(street(), viewOf(street())).size());
}

TEST(Drawing, LinesToFarAwayPointsAreDrawnAsFarAsTheImageGoes) {
  cv::Mat image(100, 200, CV_8UC3, kPaper);
  drawLine(image, {{50, 50}, {1e7, 50}}, {kInk, 1});
  drawLine(image, {{-1e9, 1e9}, {-1e9, 2e9}}, {kInk, 1});
  EXPECT_EQ(coverage(image, {51, 50}, {198, 50}, kInk), 1.0);
  EXPECT_EQ(count(image.rowRange(60, 100), kPaper), 40 * 200);
  cv::Point2d a(-10, 5), b(30, 5);
  EXPECT_TRUE(clip({0, 0, 20, 10}, a, b));
  EXPECT_EQ(a, cv::Point2d(0, 5));
  EXPECT_EQ(b, cv::Point2d(20, 5));
  a = {-10, 5}, b = {5, 30};
  EXPECT_FALSE(clip({0, 0, 20, 10}, a, b));
}

TEST(Drawing, DashesRunOnOverTheJointsOfALine) {
  cv::Mat image(20, 400, CV_8UC3, kPaper);
  Polyline line;
  for (int x = 10; x <= 390; x += 3) line.emplace_back(x, 10);  // segments shorter than a dash
  drawLine(image, line, {kInk, 1, true, 8.0, 8.0});
  int changes = 0;
  for (int x = 11; x < 390; ++x) {
    const auto dark = [&](int at) { return apart(image.at<cv::Vec3b>(10, at), kPaper) > 90; };
    changes += dark(x) != dark(x - 1) ? 1 : 0;
  }
  EXPECT_NEAR(changes, 2 * 380 / 16, 2);
}

TEST(Drawing, TheUsualClassesDifferFromOneAnotherAndFromTheTruth) {
  const char* names[] = {"car",          "van",     "person", "bicycle", "chair",
                         "dining table", "monitor", "couch",  "toy",     "other"};
  const auto distance = [](const Colour& a, const Colour& b) { return cv::norm(a - b); };
  for (const char* a : names) {
    EXPECT_GT(distance(classColour(a), kTruthColour), 60.0) << a;
    for (const char* b : names) {
      if (a == b) continue;
      EXPECT_GT(distance(classColour(a), classColour(b)), 40.0) << a << " " << b;
    }
  }
  EXPECT_EQ(classColour("giraffe"), classColour("giraffe"));
}

}  // namespace
}  // namespace perdure::tools
