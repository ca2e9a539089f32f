#include "services/semantic_filter/node.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "services/semantic_filter/core/belief/track_message.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::detect;
using testing::detectionsAt;
using testing::driveTo;
using testing::Harness;
using testing::makeState;
using testing::odometryAt;
using testing::stampOf;
using testing::TrueObject;

const std::vector<TrueObject> kStreet = {{makeState(18, 3.5, 0.75, 0.1, 4.3, 1.75, 1.5), "car"},
                                         {makeState(22, -4.0, 0.75, 3.0, 4.0, 1.7, 1.45), "car"},
                                         {makeState(30, 4.0, 0.75, 0.0, 4.4, 1.8, 1.5), "car"}};

std::vector<Detection> boxesAt(const std::vector<TrueObject>& objects, std::uint64_t k,
                               double metres, std::uint32_t seed = 1, double noise = 0.5) {
  static const CameraModel camera{testing::makeCamera()};
  std::mt19937 random(seed * 1000 + static_cast<std::uint32_t>(k));
  View view;
  view.camera = &camera;
  view.T_WB = driveTo(k, metres);
  std::vector<Detection> list;
  for (const auto& o : objects) {
    if (auto d = detect(o, view, BoxParameters{}, noise, 3.0, random)) list.push_back(*d);
  }
  return list;
}

void drive(Harness& h, std::uint64_t from, std::uint64_t to, double metres = 0.4) {
  for (std::uint64_t k = from; k < to; ++k) {
    h.node.onOdometry(odometryAt(k, driveTo(k, metres)));
    h.node.onDetections(detectionsAt(k, boxesAt(kStreet, k, metres)));
  }
}

double distanceBetween(const Belief& a, const Belief& b) {
  if (a.tracks.size() != b.tracks.size()) return 1e9;
  double worst = 0.0;
  for (std::size_t j = 0; j < a.tracks.size(); ++j) {
    const Track &x = a.tracks[j], &y = b.tracks[j];
    if (x.hypotheses.size() != y.hypotheses.size()) return 1e9;
    worst = std::max(worst, std::abs(x.existence - y.existence));
    for (std::size_t i = 0; i < x.hypotheses.size(); ++i) {
      const Hypothesis &g = x.hypotheses[i], &h = y.hypotheses[i];
      worst = std::max({worst, std::abs(g.weight - h.weight), (g.x - h.x).cwiseAbs().maxCoeff(),
                        (g.P - h.P).cwiseAbs().maxCoeff(), (g.C - h.C).cwiseAbs().maxCoeff()});
    }
  }
  return worst;
}

const ObjectBelief* nearest(const Objects& message, const State& x) {
  const ObjectBelief* best = nullptr;
  double distance = 5.0;
  for (const auto& o : message.objects) {
    const double d = (o.best().mean.head<3>() - x.head<3>()).norm();
    if (d < distance) distance = d, best = &o;
  }
  return best;
}

TEST(Node, PublishesOneMessageForEachFrameInOrder) {
  Harness h;
  drive(h, 0, 12);
  ASSERT_EQ(h.objects.size(), 12u);
  for (std::uint64_t k = 0; k < 12; ++k) EXPECT_EQ(h.objects[k].stamp.sequence, k);
  h.node.onOdometry(odometryAt(12, driveTo(12, 0.4)));
  EXPECT_EQ(h.objects.size(), 12u);  // waits for its detections
  h.node.flush();
  EXPECT_EQ(h.objects.size(), 13u);
}

TEST(Node, MapsAStreetOfParkedCars) {
  Harness h;
  drive(h, 0, 36);
  for (const auto& truth : kStreet) {
    const ObjectBelief* o = nearest(h.objects.back(), truth.x);
    ASSERT_TRUE(o) << "no object near x = " << truth.x[0];
    EXPECT_TRUE(o->confirmed);
    EXPECT_EQ(o->best().name, "car");
    const double error = (o->best().mean.head<3>() - truth.x.head<3>()).norm();
    const double sigma = std::sqrt(o->best().covariance.topLeftCorner<3, 3>().trace());
    EXPECT_LT(error, 3.0 * sigma);
    EXPECT_LT(error, 3.0);
  }
  const auto confirmed =
      std::count_if(h.objects.back().objects.begin(), h.objects.back().objects.end(),
                    [](const auto& o) { return o.confirmed; });
  EXPECT_EQ(confirmed, 3);
}

/// Points on the fronts of the cars, in pixels of `camera`; another camera has other pixels.
Landmarks landmarksAt(std::uint64_t k, const std::string& camera) {
  static const CameraModel model{testing::makeCamera()};
  Landmarks m;
  m.stamp = stampOf(k);
  m.instance = 2;
  m.world = {5, 0};
  m.camera = camera;
  const RigidTransform T_CW = (driveTo(k, 0.4) * model.T_BC()).inverse();
  for (const auto& o : kStreet) {
    for (int i = -2; i <= 2; ++i) {
      Landmark l;
      l.id = m.landmarks.size();
      l.p_W = o.x.head<3>() + Eigen::Vector3d(-2.0, 0.3 * i, 0.1 * i);
      l.covariance = 1e-4 * Eigen::Matrix3d::Identity();
      const auto pixel = model.project(T_CW * l.p_W);
      if (!pixel || !model.inImage(*pixel)) continue;
      l.pixel = *pixel + (camera == "cam0" ? 0.0 : 80.0) * Eigen::Vector2d::UnitX();
      m.landmarks.push_back(l);
    }
  }
  return m;
}

TEST(Node, PointsOfAnotherCameraLieWhereItsOwnCameraHasThem) {
  Harness none, own, other;
  for (std::uint64_t k = 0; k < 20; ++k) {
    for (Harness* h : {&none, &own, &other}) {
      h->node.onOdometry(odometryAt(k, driveTo(k, 0.4)));
      if (h != &none) h->node.onLandmarks(landmarksAt(k, h == &own ? "cam0" : "cam1"));
      h->node.onDetections(detectionsAt(k, boxesAt(kStreet, k, 0.4)));
    }
  }
  EXPECT_GT(distanceBetween(none.node.belief(), own.node.belief()), 1e-7) << "points matter";
  EXPECT_LT(distanceBetween(own.node.belief(), other.node.belief()), 1e-9);
}

TEST(Node, TopDownAnswersAloneInitiateNoTrack) {
  Harness h;
  for (std::uint64_t k = 0; k < 20; ++k) {
    auto boxes = boxesAt(kStreet, k, 0.4);
    for (auto& d : boxes) d.primed = true, d.primed_for = 77;
    ASSERT_FALSE(boxes.empty());
    h.node.onOdometry(odometryAt(k, driveTo(k, 0.4)));
    h.node.onDetections(detectionsAt(k, boxes));
  }
  EXPECT_TRUE(h.node.belief().tracks.empty());
}

TEST(Node, LateAndDisorderedDetectionsGiveThePosteriorOfThoseOnTime) {
  Harness on_time, late;
  drive(on_time, 0, 30);
  const auto detections = [](std::uint64_t k) { return detectionsAt(k, boxesAt(kStreet, k, 0.4)); };
  for (std::uint64_t k = 0; k < 30; ++k) {
    late.node.onOdometry(odometryAt(k, driveTo(k, 0.4)));
    if (k >= 2 && k % 4 == 3) {  // two pairs arrive together, the newer first
      late.node.onDetections(detections(k - 2));
      late.node.onDetections(detections(k - 3));
    } else if (k >= 2 && k % 4 == 1) {
      late.node.onDetections(detections(k - 2));
      late.node.onDetections(detections(k - 3));
    }
  }
  late.node.flush();
  late.node.onDetections(detections(28));
  late.node.onDetections(detections(29));
  ASSERT_GT(late.node.reasons().of("detections_late"), 20u);
  EXPECT_LT(distanceBetween(on_time.node.belief(), late.node.belief()), 1e-9);
  EXPECT_GE(on_time.node.belief().tracks.size(), 3u);
}

TEST(Node, IdsSurviveARollBack) {
  Harness h;
  drive(h, 0, 10);
  h.node.onOdometry(odometryAt(10, driveTo(10, 0.4)));
  drive(h, 11, 14);
  const Objects before = h.objects.back();
  h.node.onDetections(detectionsAt(10, boxesAt(kStreet, 10, 0.4)));
  drive(h, 14, 15);
  for (const auto& truth : kStreet) {
    const auto *a = nearest(before, truth.x), *b = nearest(h.objects.back(), truth.x);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->id, b->id);
  }
}

TEST(Node, AFrameWithoutDetectionsSaysNothingAndAnEmptyListIsAMiss) {
  Harness silent, empty;
  drive(silent, 0, 20);
  drive(empty, 0, 20);
  const Belief before = silent.node.belief();
  for (std::uint64_t k = 20; k < 25; ++k) {
    silent.node.onOdometry(odometryAt(k, driveTo(k, 0.4)));
    empty.node.onOdometry(odometryAt(k, driveTo(k, 0.4)));
    empty.node.onDetections(detectionsAt(k, {}));
  }
  silent.node.flush();
  EXPECT_EQ(distanceBetween(before, silent.node.belief()), 0.0);
  const auto existence = [](const Harness& h) { return h.node.belief().tracks.front().existence; };
  EXPECT_LT(existence(empty), existence(silent));
}

TEST(Node, DetectionOnAnotherVisitRaisesExistence) {
  const auto surest = [](const Harness& h) {
    double most = 0.0;
    for (const auto& o : h.objects.back().objects) most = std::max(most, o.existence);
    return most;
  };
  const TrackParameters parameters;
  Harness h;
  drive(h, 0, 20);
  EXPECT_NEAR(surest(h), parameters.certain, 1e-6);
  RigidTransform away = driveTo(20, 0.4);
  away.q = away.q * Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  for (std::uint64_t k = 20; k < 50; ++k) {
    h.node.onOdometry(odometryAt(k, k < 40 ? away : driveTo(20, 0.4)));
    h.node.onDetections(
        detectionsAt(k, k < 40 ? std::vector<Detection>{}
                               : boxesAt(kStreet, 20, 0.4, static_cast<std::uint32_t>(k))));
  }
  EXPECT_GT(surest(h), parameters.certain);
  EXPECT_LE(surest(h), parameters.certain_again);
}

/// The camera views the street, turns away for three seconds, and then views the whole street
/// again. Returns the ids of the cars that were placed to a metre; the others need more views.
std::vector<ObjectId> missForAWhile(Harness& h) {
  drive(h, 0, 20);
  std::vector<ObjectId> ids;
  for (const Track& o : h.node.belief().tracks) {
    const bool placed = o.best().P.topLeftCorner<3, 3>().trace() < 1.0;
    if (o.life.confirmed && placed) ids.push_back(o.id);
  }
  RigidTransform away = driveTo(20, 0.4);
  away.q = away.q * Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  for (std::uint64_t k = 20; k < 90; ++k) {
    h.node.onOdometry(odometryAt(k, k < 40 ? away : driveTo(20, 0.4)));
    h.node.onDetections(
        detectionsAt(k, k < 70 ? std::vector<Detection>{} : boxesAt(kStreet, 20, 0.4, k)));
  }
  return ids;
}

TEST(Node, ADeletedTrackDetectedInItsPlaceIsReidentified) {
  const auto count = [](const Harness& h, EventKind kind, ObjectId id) {
    return std::count_if(h.events.begin(), h.events.end(),
                         [&](const Event& e) { return e.kind == kind && e.object_id == id; });
  };
  Harness h;
  const auto ids = missForAWhile(h);
  ASSERT_GE(ids.size(), 2u);
  for (const ObjectId id : ids) {
    ASSERT_EQ(count(h, EventKind::kGone, id), 1);
    EXPECT_EQ(count(h, EventKind::kBorn, id), 1);
    EXPECT_EQ(count(h, EventKind::kMerged, id), 1);
    EXPECT_EQ(count(h, EventKind::kReappeared, id), 1);
    const auto& now = h.objects.back().objects;
    const auto back = std::find_if(now.begin(), now.end(), [&](auto& o) { return o.id == id; });
    ASSERT_NE(back, now.end());
    EXPECT_TRUE(back->confirmed);
    EXPECT_EQ(toNanoseconds(back->first_seen), 0);
  }

  Config forgets;
  forgets.filter.tracks.reidentify_s = 0.5;
  Harness short_memory(forgets);
  for (const ObjectId id : missForAWhile(short_memory)) {
    EXPECT_EQ(count(short_memory, EventKind::kReappeared, id), 0);
  }
}

TEST(Node, AnOutOfViewTrackKeepsEveryBitAndItsId) {
  Harness h;
  drive(h, 0, 20);
  const Belief before = h.node.belief();
  RigidTransform away = driveTo(19, 0.4);
  away.q = away.q * Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  for (std::uint64_t k = 20; k < 80; ++k) {
    h.node.onOdometry(odometryAt(k, away));
    h.node.onDetections(detectionsAt(k, {}));
  }
  EXPECT_EQ(distanceBetween(before, h.node.belief()), 0.0);
  EXPECT_EQ(h.objects.back().objects.front().visibility, Visibility::kBehind);
  const auto reappeared = [&] {
    return std::count_if(h.events.begin(), h.events.end(),
                         [](const Event& e) { return e.kind == EventKind::kReappeared; });
  };
  h.node.onOdometry(odometryAt(80, driveTo(20, 0.4)));
  h.node.onDetections(detectionsAt(80, {}));
  EXPECT_EQ(h.objects.back().objects.front().visibility, Visibility::kVisible);
  EXPECT_EQ(reappeared(), 0) << "it should be visible, and was not detected yet";
  for (std::uint64_t k = 81; k < 85; ++k) {
    h.node.onOdometry(odometryAt(k, driveTo(20, 0.4)));
    h.node.onDetections(detectionsAt(k, boxesAt(kStreet, 20, 0.4)));
  }
  ASSERT_EQ(h.node.belief().tracks.size(), before.tracks.size());
  for (std::size_t j = 0; j < before.tracks.size(); ++j) {
    EXPECT_EQ(h.node.belief().tracks[j].id, before.tracks[j].id);
  }
  const auto confirmed = std::count_if(before.tracks.begin(), before.tracks.end(),
                                       [](const Track& o) { return o.life.confirmed; });
  EXPECT_GE(confirmed, 2);
  EXPECT_EQ(reappeared(), confirmed);
}

/// An answer of the map to the filter `client` before its first frame.
MapNear nearOf(std::vector<ObjectBelief> placed, ObjectId next_id, InstanceId client = 9) {
  MapNear near;
  near.instance = 5;
  near.revision = 1;
  near.world = {5, 0};
  near.client = client;
  near.next_id = next_id;
  near.placed = std::move(placed);
  return near;
}

/// Map objects with the given variance, which replace a first frame.
MapNear restored(const std::vector<TrueObject>& things, const std::vector<double>& variances) {
  std::vector<ObjectBelief> placed;
  for (std::size_t i = 0; i < things.size(); ++i) {
    Track object = testing::makeObject(i + 1, things[i].class_name, things[i].x, variances[i]);
    object.life.confirmed = true;
    placed.push_back(toBelief(object, testing::makePriors(), 0.7));
  }
  return nearOf(std::move(placed), 10);
}

TEST(Node, ABoxThatOnlyAnOccludedTrackExplainsRevisesTheOcclusionAndInitiatesNothing) {
  // A table that the image border cuts and a chair that hides it except for a part, which the
  // network detects. The box of the chair has the same upper and lower side.
  const State table = makeState(8.3, -6.6, 0.37, 0, 0.8, 1.5, 0.74);
  const State chair = makeState(6.9, -4.9, 0.59, 0, 0.5, 0.75, 0.64);
  Harness h;
  const std::vector<TrueObject> things{{table, "dining table"}, {chair, "chair"}};
  h.node.onNear(restored(things, {1e-4, 1e-4}));
  const auto boxes = [&](std::uint64_t k) { return boxesAt(things, k, 0.0); };
  for (std::uint64_t k = 0; k < 10; ++k) {
    h.node.onOdometry(odometryAt(k, driveTo(0, 0.0)));
    if (k == 0) {
      h.node.flush();
      const auto& seen = h.objects.back().objects;
      ASSERT_EQ(seen.size(), 2u);
      ASSERT_EQ(seen[0].visibility, Visibility::kOccluded);
      ASSERT_EQ(seen[0].blocked_by, 2u);
    }
    ASSERT_EQ(boxes(k).size(), 2u);
    h.node.onDetections(detectionsAt(k, boxes(k)));
  }
  h.node.flush();
  ASSERT_EQ(h.node.belief().tracks.size(), 2u);
  EXPECT_GE(h.node.belief().tracks[0].life.hits, 12u);
}

TEST(Node, ABoxOfAPartialViewIsNotThatOfARemovedObjectBesideIt) {
  // Two chairs at the left border: a strip of one is in the image, and the nearer one was removed.
  const TrueObject at_border{makeState(6.3, 5.38, 0.45, 0, 0.5, 0.5, 0.9), "chair"};
  const TrueObject taken{makeState(5.6, 4.35, 0.45, 0, 0.5, 0.5, 0.9), "chair"};
  Harness h;
  h.node.onNear(restored({at_border, taken}, {1e-4, 0.01}));
  double before = 0.0;
  for (std::uint64_t k = 0; k < 8; ++k) {
    h.node.onOdometry(odometryAt(k, driveTo(0, 0.0)));
    if (k == 0) {
      h.node.flush();
      const auto& seen = h.objects.back().objects;
      ASSERT_EQ(seen.size(), 2u);
      ASSERT_EQ(seen[0].visibility, Visibility::kOutOfView);
      ASSERT_NE(seen[1].visibility, Visibility::kOutOfView);
      before = h.node.belief().tracks[0].existence;
    }
    const auto boxes = boxesAt({at_border}, k, 0.0);
    ASSERT_EQ(boxes.size(), 1u);
    h.node.onDetections(detectionsAt(k, boxes));
  }
  h.node.flush();
  const auto& objects = h.node.belief().tracks;
  ASSERT_FALSE(objects.empty());
  ASSERT_EQ(objects[0].id, 1u);
  EXPECT_EQ(objects[0].life.hits, 4u);
  EXPECT_EQ(objects[0].existence, before);
  for (const Track& o : objects) {
    if (o.id == 1) continue;
    EXPECT_EQ(o.id, 2u);
    EXPECT_EQ(o.life.hits, 4u);
    // Something off the map may hide it too: it is restored without directions of detections.
    EXPECT_LT(o.existence, 0.9);
  }
}

TEST(Node, ARestartedNodeContinuesWithTheSameIds) {
  Harness first;
  drive(first, 0, 20);
  const MapNear near = nearOf(first.objects.back().objects, first.objects.back().next_id, 77);
  Harness second({}, 77), stranger({}, 78);
  second.node.onNear(near);
  stranger.node.onNear(near);
  drive(second, 20, 25);
  drive(stranger, 20, 25);
  for (const auto& truth : kStreet) {
    const auto* a = nearest(first.objects.back(), truth.x);
    const auto* b = nearest(second.objects.back(), truth.x);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->id, b->id);
  }
  EXPECT_GE(second.objects.back().next_id, near.next_id);
  EXPECT_EQ(stranger.objects.back().objects.front().id, 1u);
}

TEST(Node, WrongInputIsCountedAndHarmless) {
  Harness h;
  drive(h, 0, 5);
  Odometry bad = odometryAt(5, driveTo(5, 0.4));
  bad.T_WB.p.x() = std::nan("");
  h.node.onOdometry(bad);
  h.node.onOdometry(odometryAt(5, driveTo(5, 0.4)));
  Detections d = detectionsAt(5, boxesAt(kStreet, 5, 0.4));
  d.detections[0].activations.resize(2);
  h.node.onDetections(d);
  d = detectionsAt(5, boxesAt(kStreet, 5, 0.4));
  d.detections[1].box.x1 = std::nan("");
  h.node.onDetections(d);
  h.node.onDetections(detectionsAt(5, boxesAt(kStreet, 5, 0.4)));
  h.node.onDetections(detectionsAt(5, boxesAt(kStreet, 5, 0.4)));
  Detections unknown = detectionsAt(6, {});
  unknown.model_hash = 99;
  h.node.onOdometry(odometryAt(6, driveTo(6, 0.4)));
  h.node.onDetections(unknown);
  EXPECT_EQ(h.node.reasons().of("odometry_not_finite"), 1u);
  EXPECT_EQ(h.node.reasons().of("detections_classes_mismatch"), 1u);
  EXPECT_EQ(h.node.reasons().of("detections_not_finite"), 1u);
  EXPECT_EQ(h.node.reasons().of("detections_repeated"), 1u);
  EXPECT_EQ(h.node.reasons().of("detections_of_unknown_model"), 1u);
}

TEST(Node, TwoRunsGiveTheSameNumbers) {
  Harness a, b;
  drive(a, 0, 25);
  drive(b, 0, 25);
  EXPECT_EQ(distanceBetween(a.node.belief(), b.node.belief()), 0.0);
}

}  // namespace
}  // namespace perdure::semantic_filter
