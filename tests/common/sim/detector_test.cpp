#include "common/sim/detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "tests/support/camera.h"

namespace perdure::sim {
namespace {

constexpr std::uint64_t kFrames = 20000;

CameraCalibration camera() { return tests::cameraAhead(640, 480, 380); }

TruthObject thing(std::uint64_t id, const std::string& class_name, const Eigen::Vector3d& centre,
                  double yaw) {
  TruthObject object;
  object.id = id;
  object.class_name = object.looks_like = class_name;
  object.size = {4.0, 1.8, 1.5};
  object.present_from = fromNanoseconds(0);
  object.present_until = fromNanoseconds(1'000'000'000'000'000);
  object.keys = {{fromNanoseconds(0), centre, yaw}};
  return object;
}

/// Returns a truth with the same view of one object in every frame.
Truth sameView(const Box& box, double visible, const std::string& class_name = "car",
               std::uint64_t frames = kFrames) {
  Truth truth;
  truth.objects = {thing(1, class_name, {10, 2, 0}, 0.7)};
  for (std::uint64_t frame = 0; frame < frames; ++frame) truth.views[frame] = {{1, visible, box}};
  return truth;
}

/// Returns a model with independent errors in each frame and without false boxes, so that the
/// statistics are simple.
DetectorModel independent() {
  DetectorModel model;
  model.persistent_share = 0.0;
  model.false_per_frame = 0.0;
  return model;
}

FrameStamp stamp(std::uint64_t frame) {
  return {1, frame, fromNanoseconds(static_cast<std::int64_t>(frame) * 50'000'000), 0};
}

std::vector<Detection> collect(const SimulatedDetector& detector, std::uint64_t frames = kFrames) {
  std::vector<Detection> all;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    const auto found = detector.detect(frame, stamp(frame), {}).detections;
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

double shareFound(const Box& box, double visible) {
  const SimulatedDetector detector(independent(), sameView(box, visible), camera());
  return static_cast<double>(collect(detector).size()) / kFrames;
}

const Box kLarge{200, 150, 300, 230};

TEST(SimulatedDetector, FindsByTheSizeAndTheShareThatIsSeen) {
  const DetectorModel model;
  EXPECT_NEAR(shareFound(kLarge, 1.0), model.found, 0.006);
  const double half = model.half_size_px;
  EXPECT_NEAR(shareFound({100, 100, 100 + half, 100 + half}, 1.0), 0.5 * model.found, 0.012);
  EXPECT_NEAR(shareFound(kLarge, model.half_visible), 0.5 * model.found, 0.012);
  EXPECT_LT(shareFound({100, 100, 105, 105}, 1.0), 0.02);
  EXPECT_EQ(shareFound(kLarge, 0.5 * model.least_visible), 0.0);
  // If the border cuts an object, only the part in the image counts.
  EXPECT_NEAR(shareFound({-100, 150, 100, 230}, 0.5), model.found, 0.006);
}

TEST(SimulatedDetector, ItsBoxesHaveTheirDeviationAndCorrelation) {
  DetectorModel model = independent();
  const SimulatedDetector detector(model, sameView(kLarge, 1.0), camera());
  double x1 = 0, y2 = 0, both = 0, mean = 0;
  const auto found = collect(detector);
  for (const Detection& d : found) {
    const double e1 = d.box.x1 - kLarge.x1, e2 = d.box.x2 - kLarge.x2;
    x1 += e1 * e1, both += e1 * e2, mean += e1;
    y2 += (d.box.y2 - kLarge.y2) * (d.box.y2 - kLarge.y2);
  }
  const double n = static_cast<double>(found.size());
  const double sigma_x = std::hypot(100 * model.box_share, model.box_floor_px);
  const double sigma_y = std::hypot(80 * model.box_share, model.box_floor_px);
  EXPECT_NEAR(mean / n, 0.0, 0.1);
  EXPECT_NEAR(std::sqrt(x1 / n) / sigma_x, 1.0, 0.03);
  EXPECT_NEAR(std::sqrt(y2 / n) / sigma_y, 1.0, 0.03);
  EXPECT_NEAR(both / x1, model.side_correlation, 0.04);
}

TEST(SimulatedDetector, CutsItsBoxesAtTheBorder) {
  const SimulatedDetector detector(independent(), sameView({-80, 150, 100, 500}, 0.5), camera());
  for (const Detection& d : collect(detector, 500)) {
    EXPECT_EQ(d.box.x1, 0.0);
    EXPECT_EQ(d.box.y2, 480.0);
    EXPECT_NE(d.box.x2, 100.0);
  }
}

TEST(SimulatedDetector, OfAThingThatTheBorderCutsItSeesThePartInside) {
  DetectorModel model = independent();
  model.box_share = model.box_floor_px = 0.0;
  Truth truth = sameView({-80, 150, 100, 300}, 0.5);
  for (auto& [frame, views] : truth.views) views[0].inside = Box{-0.5, 160, 100, 250};
  const auto found = collect(SimulatedDetector(model, truth, camera()), 50);
  ASSERT_FALSE(found.empty());
  for (const Detection& d : found) {
    EXPECT_EQ(d.box.x1, 0.0);
    EXPECT_NEAR(d.box.y1, 160.0, 1e-9);
    EXPECT_NEAR(d.box.y2, 250.0, 1e-9);
  }
}

TEST(SimulatedDetector, ShrinksItsBoxToWhatANearerThingLeavesOfIt) {
  DetectorModel model = independent();
  model.box_share = model.box_floor_px = 0.0;
  Truth truth;
  truth.objects = {thing(1, "car", {20, 0, 0}, 0), thing(2, "van", {8, 0, 0}, 0)};
  for (std::uint64_t frame = 0; frame < 500; ++frame) {
    truth.views[frame] = {{1, 0.45, {200, 150, 300, 230}}, {2, 1.0, {100, 100, 255, 300}}};
  }
  const SimulatedDetector detector(model, truth, camera());
  std::size_t cars = 0;
  for (const Detection& d : collect(detector, 500)) {
    if (d.box.x2 != 300.0) continue;
    ++cars;
    EXPECT_NEAR(d.box.x1, 255.0, 1e-9);
    EXPECT_EQ(d.box.y2, 230.0);
  }
  EXPECT_GT(cars, 300u);
}

TEST(SimulatedDetector, GivesAsManyFalseAlarmsAsItSays) {
  DetectorModel model = independent();
  model.false_per_frame = 1.7;
  const SimulatedDetector detector(model, Truth{}, camera());
  const auto found = collect(detector);
  EXPECT_NEAR(static_cast<double>(found.size()) / kFrames, 1.7, 0.04);
  for (const Detection& d : found) {
    EXPECT_LT(d.box.x1, d.box.x2);
    EXPECT_GE(d.box.y1, 0.0);
    EXPECT_LE(d.box.y2, 480.0);
  }
}

/// Returns the soft-max of the activations with uniform priors.
std::vector<double> posterior(const Detection& d) {
  std::vector<double> p;
  for (const float a : d.activations) p.push_back(std::exp(static_cast<double>(a)));
  const double sum = std::accumulate(p.begin(), p.end(), 0.0);
  for (double& value : p) value /= sum;
  return p;
}

/// Uses objects of all classes, each as often as one false alarm.
TEST(SimulatedDetector, ItsActivationsAreCalibrated) {
  DetectorModel model = independent();
  model.separation = 2.5;  // a small separation makes classification errors frequent
  model.found = 1.0;
  model.half_size_px = 10.0;
  std::vector<std::pair<std::size_t, Detection>> looks;
  const Box box{100, 100, 118, 118};
  for (std::size_t k = 0; k < model.classes.size(); ++k) {
    const SimulatedDetector detector(model, sameView(box, 1.0, model.classes[k]), camera());
    for (auto& d : collect(detector, 5000)) looks.emplace_back(k + 1, std::move(d));
  }
  model.false_per_frame = 1.0;
  model.false_smallest_px = 18.0;
  CameraCalibration tiny = camera();
  tiny.width = tiny.height = 18;  // false alarms of the same size have the same quality
  const std::size_t each = looks.size() / model.classes.size();
  for (auto& d : collect(SimulatedDetector(model, Truth{}, tiny), 6000)) {
    if (looks.size() < each * (model.classes.size() + 1)) looks.emplace_back(0, std::move(d));
  }
  ASSERT_EQ(looks.size(), each * (model.classes.size() + 1));
  // Reliability: of all statements "class k with probability p", a share p is true.
  std::array<double, 10> said{}, true_of{}, count{};
  for (const auto& [truth, d] : looks) {
    const auto p = posterior(d);
    for (std::size_t k = 0; k < p.size(); ++k) {
      const auto bin = std::min<std::size_t>(9, static_cast<std::size_t>(10 * p[k]));
      said[bin] += p[k], count[bin] += 1, true_of[bin] += truth == k ? 1 : 0;
    }
  }
  for (std::size_t bin = 0; bin < 10; ++bin) {
    ASSERT_GT(count[bin], 500) << bin;
    EXPECT_NEAR(true_of[bin] / count[bin], said[bin] / count[bin], 0.03) << bin;
  }
}

TEST(SimulatedDetector, ConfusesPairsAsOftenAsItSays) {
  DetectorModel model = independent();
  model.confusion = {{"car", "van", 0.1}};
  const SimulatedDetector detector(model, sameView(kLarge, 1.0, "car"), camera());
  const auto found = collect(detector);
  double vans = 0, others = 0;
  for (const Detection& d : found) {
    vans += d.activations[2] > d.activations[1];
    others += d.activations[3] > d.activations[1];
  }
  EXPECT_NEAR(vans / static_cast<double>(found.size()), 0.1, 0.01);
  EXPECT_LT(others / static_cast<double>(found.size()), 0.01);
}

TEST(SimulatedDetector, AToyIsTakenForACar) {
  Truth truth = sameView(kLarge, 1.0, "toy");
  truth.objects[0].looks_like = "car";
  double sum = 0;
  const auto found = collect(SimulatedDetector(independent(), truth, camera()), 1000);
  for (const Detection& d : found) sum += d.activations[1] - d.activations[0];
  const double separation = DetectorModel{}.separation;
  EXPECT_NEAR(sum / static_cast<double>(found.size()), 0.5 * separation * separation, 0.6);
}

TEST(SimulatedDetector, AzimuthIsKittisAlphaWithItsDeviationAndFlips) {
  DetectorModel model = independent();
  // The body looks along +x. The object is 10 m ahead and 2 m to the left, rotated by 0.7 rad.
  const SimulatedDetector detector(model, sameView(kLarge, 1.0), camera());
  // KITTI's rotation_y is 0 for an object that points to the right. It increases clockwise, seen
  // from above.
  const double alpha = (-M_PI_2 - 0.7) - std::atan2(-2.0, 10.0);
  double squares = 0, upright = 0, flips = 0;
  const auto found = collect(detector);
  for (const Detection& d : found) {
    ASSERT_TRUE(d.azimuth);
    EXPECT_EQ(d.azimuth_sigma, model.azimuth_sigma);
    const double error = wrapAngle(*d.azimuth - alpha);
    if (std::abs(error) > M_PI_2) {
      flips += 1;
    } else {
      upright += 1, squares += error * error;
    }
  }
  EXPECT_NEAR(std::sqrt(squares / upright), model.azimuth_sigma, 0.005);
  EXPECT_NEAR(flips / (flips + upright), model.flip_share, 0.008);
}

TEST(SimulatedDetector, LooksFromTheSamePlaceErrAlikeAndFromElsewhereDoNot) {
  DetectorModel model;
  model.false_per_frame = 0.0;
  model.persistent_share = 0.6;
  const auto correlation = [&](const RigidTransform& elsewhere) {
    double both = 0, first = 0, second = 0;
    for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
      model.seed = seed;
      Truth truth;
      truth.objects = {thing(1, "car", {10, 2, 0}, 0.7)};
      truth.views[0] = truth.views[1] = {{1, 1.0, kLarge}};
      const SimulatedDetector detector(model, truth, camera());
      const auto a = detector.detect(0, stamp(0), {}).detections;
      const auto b = detector.detect(1, stamp(1), elsewhere).detections;
      if (a.empty() || b.empty()) continue;
      const double e = a[0].box.x1 - kLarge.x1, f = b[0].box.x1 - kLarge.x1;
      both += e * f, first += e * e, second += f * f;
    }
    return both / std::sqrt(first * second);
  };
  EXPECT_NEAR(correlation({}), 0.6, 0.04);
  const RigidTransform aside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(2, 4, 0));
  EXPECT_NEAR(correlation(aside), 0.0, 0.2);
}

TEST(SimulatedDetector, AShareOfItsSidesHasHeavyErrors) {
  DetectorModel model = independent();
  model.tail_share = 0.2;
  model.tail_scale = 4.0;
  const SimulatedDetector detector(model, sameView(kLarge, 1.0), camera());
  const double sigma = std::hypot(100 * model.box_share, model.box_floor_px);
  const auto found = collect(detector);
  double beyond = 0;
  for (const Detection& d : found) beyond += std::abs(d.box.x1 - kLarge.x1) > 3.0 * sigma;
  const double expected = 0.8 * std::erfc(3.0 / M_SQRT2) + 0.2 * std::erfc(0.75 / M_SQRT2);
  EXPECT_NEAR(beyond / static_cast<double>(found.size()), expected, 0.006);
}

TEST(SimulatedDetector, ErrorsOfSidesLastForTheirTimeConstant) {
  DetectorModel model = independent();
  model.found = 1.0;
  model.half_size_px = 2.0;
  model.error_time_s = 0.3;
  constexpr std::uint64_t kRuns = 6000;
  // product with the first frame's error, by distance in frames of 50 ms
  std::array<double, 20> product{};
  const Truth truth = sameView(kLarge, 1.0, "car", product.size());
  for (model.seed = 1; model.seed <= kRuns; ++model.seed) {
    const auto found = collect(SimulatedDetector(model, truth, camera()), product.size());
    if (found.size() < product.size()) continue;
    for (std::size_t i = 0; i < found.size(); ++i) {
      product[i] += (found[0].box.x1 - kLarge.x1) * (found[i].box.x1 - kLarge.x1);
    }
  }
  for (const std::size_t frames : {2, 6, 12, 19}) {
    const double correlation = product[frames] / product[0];
    EXPECT_NEAR(correlation, std::exp(-0.05 * static_cast<double>(frames) / 0.3), 0.04) << frames;
  }
}

/// A car that drifts by 4 px in a frame and is hidden from frame 20 on.
Truth carThatBecomesHidden() {
  Truth truth = sameView(kLarge, 1.0);
  for (std::uint64_t frame = 0; frame < 40; ++frame) {
    const double x = 4.0 * static_cast<double>(frame);
    truth.views[frame] = {{1, frame < 20 ? 1.0 : 0.0, {200 + x, 150, 300 + x, 230}}};
  }
  return truth;
}

TEST(SimulatedDetector, ContinuesTheBoxOfWhatBecomesHidden) {
  DetectorModel model = independent();
  model.found = 1.0;
  model.box_share = model.box_floor_px = 0.0;
  CameraCalibration at_20_hz = camera();
  at_20_hz.rate_hz = 20.0;
  Truth truth = carThatBecomesHidden();
  truth.views[22][0].box = kLarge;  // the continued box does not depend on the hidden truth
  const SimulatedDetector sharp(model, truth, at_20_hz);
  EXPECT_TRUE(sharp.detect(20, stamp(20), {}).detections.empty());
  model.coast_s = 0.2;
  const SimulatedDetector tracker(model, truth, at_20_hz);
  for (std::uint64_t frame = 20; frame < 30; ++frame) {
    const auto found = tracker.detect(frame, stamp(frame), {}).detections;
    ASSERT_EQ(found.size(), frame < 24 ? 1u : 0u) << frame;
    if (found.empty()) continue;
    EXPECT_NEAR(found[0].box.x1, 200 + 4.0 * static_cast<double>(frame), 1e-9) << frame;
    EXPECT_NEAR(found[0].box.x2, 300 + 4.0 * static_cast<double>(frame), 1e-9) << frame;
  }
}

TEST(SimulatedDetector, EnclosesTheImageOfTheCuboidAndDeclaresItOrNot) {
  DetectorModel model = independent();
  model.found = 1.0;
  model.box_share = model.box_floor_px = 0.0;
  model.boxes = BoxExtent::kCuboid;
  Truth truth = sameView({230, 220, 270, 250}, 1.0);  // an outline within the cuboid
  truth.objects[0].keys[0].yaw = 0.0;
  const SimulatedDetector detector(model, truth, camera());
  const auto found = collect(detector, 1);
  ASSERT_EQ(found.size(), 1u);
  // The cuboid of 4 × 1.8 × 1.5 m at (10, 2, 0) is 8 to 12 m ahead; the focal length is 380 px.
  EXPECT_NEAR(found[0].box.x1, 320 - 380 * 2.9 / 8, 1e-6);
  EXPECT_NEAR(found[0].box.x2, 320 - 380 * 1.1 / 12, 1e-6);
  EXPECT_NEAR(found[0].box.y1, 240 - 380 * 0.75 / 8, 1e-6);
  EXPECT_NEAR(found[0].box.y2, 240 + 380 * 0.75 / 8, 1e-6);
  EXPECT_EQ(detector.info().boxes, BoxExtent::kCuboid);
  model.boxes = BoxExtent::kOutline;
  EXPECT_EQ(SimulatedDetector(model, truth, camera()).info().boxes, BoxExtent::kOutline);
  EXPECT_EQ(collect(SimulatedDetector(model, truth, camera()), 1)[0].box.x1, 230.0);
  model.declare_boxes = false;
  EXPECT_EQ(SimulatedDetector(model, truth, camera()).info().boxes, BoxExtent::kUnknown);
}

bool same(const Detection& a, const Detection& b) {
  return a.box.x1 == b.box.x1 && a.box.y2 == b.box.y2 && a.activations == b.activations &&
         a.azimuth == b.azimuth;
}

TEST(SimulatedDetector, DependsOnSeedFrameAndThingOnly) {
  const DetectorModel model;
  Truth truth = sameView(kLarge, 1.0);
  const SimulatedDetector detector(model, truth, camera());
  truth.objects.insert(truth.objects.begin(), thing(9, "person", {5, 0, 0}, 0));
  truth.views[7].insert(truth.views[7].begin(), {9, 1.0, {500, 100, 560, 300}});
  const SimulatedDetector with_another(model, truth, camera());
  const auto first = detector.detect(7, stamp(7), {}).detections;
  collect(detector, 5);
  const auto again = detector.detect(7, stamp(7), {}).detections;
  ASSERT_EQ(first.size(), again.size());
  ASSERT_FALSE(first.empty());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_TRUE(same(first[i], again[i]));
  const auto both = with_another.detect(7, stamp(7), {}).detections;
  for (const Detection& d : first) {
    EXPECT_TRUE(
        std::any_of(both.begin(), both.end(), [&](const Detection& o) { return same(o, d); }));
  }
  DetectorModel other = model;
  other.seed = 2;
  const auto different =
      SimulatedDetector(other, truth, camera()).detect(7, stamp(7), {}).detections;
  EXPECT_FALSE(different.size() == first.size() && same(different[0], first[0]));
}

TEST(SimulatedDetector, SeesNothingThatIsNotThere) {
  Truth truth = sameView(kLarge, 1.0);
  truth.objects[0].present_until = stamp(100).time;
  const SimulatedDetector detector(independent(), truth, camera());
  EXPECT_GT(collect(detector, 100).size(), 80u);
  for (std::uint64_t frame = 100; frame < 300; ++frame) {
    EXPECT_TRUE(detector.detect(frame, stamp(frame), {}).detections.empty());
  }
}

TEST(SimulatedDetector, RefusesNumbersThatMakeNoSense) {
  const auto complaint = [](auto change) -> std::string {
    DetectorModel model;
    change(model);
    try {
      SimulatedDetector(model, {}, camera());
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), ExitCode::kConfiguration);
      return error.what();
    }
    return "";
  };
  using testing::HasSubstr;
  EXPECT_EQ(complaint([](DetectorModel&) {}), "");
  EXPECT_THAT(complaint([](DetectorModel& m) { m.found = 1.2; }), HasSubstr("within 0 and 1"));
  EXPECT_THAT(complaint([](DetectorModel& m) { m.classes.clear(); }), HasSubstr("at least one"));
  EXPECT_THAT(complaint([](DetectorModel& m) { m.azimuth_sigma = 0; }), HasSubstr("not above 0"));
  EXPECT_THAT(complaint([](DetectorModel& m) { m.box_share = -1; }), HasSubstr("below 0"));
  EXPECT_THAT(complaint([](DetectorModel& m) { m.tail_scale = 0.5; }), HasSubstr("below 1"));
  EXPECT_THAT(complaint([](DetectorModel& m) { m.coast_s = 1; }), HasSubstr("rate_hz"));
  EXPECT_THAT(complaint([](DetectorModel& m) {
                m.confusion = {{"car", "ship", 0.1}};
              }),
              HasSubstr("ship, which is no class"));
  EXPECT_THAT(complaint([](DetectorModel& m) {
                m.confusion = {{"car", "van", 0.4}, {"van", "person", 0.4}};
              }),
              HasSubstr("alike, too"));
}

}  // namespace
}  // namespace perdure::sim
