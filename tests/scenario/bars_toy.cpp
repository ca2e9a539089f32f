// Bars of toy and still: size is observable by parallax and a prior, or not at all.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "tests/scenario/bars.h"

namespace perdure::test {
namespace {

constexpr double kDecided_s = 4.0;  ///< 40 frames at 10 Hz

/// Returns the first frame in which at least half of the object is visible.
std::uint64_t firstSight(const Outcome& run, const sim::TruthObject& object) {
  for (const auto& [frame, views] : run.truth.truth.views) {
    const sim::TruthView* view = run.viewOf(object, frame);
    if (view != nullptr && view->visible_fraction >= 0.5) return frame;
  }
  return 0;
}

/// Returns the beliefs whose centre projects into the image of a true object. Without parallax,
/// positions cannot match beliefs with objects.
std::vector<const Glance*> inImageOf(const Outcome& run, const sim::TruthObject& object,
                                     const JournalFrame& f) {
  std::vector<const Glance*> result;
  const sim::TruthView* view = run.viewOf(object, f.frame);
  if (view == nullptr) return result;
  const RigidTransform T_CW = (f.T_WB * run.truth.camera.T_BC()).inverse();
  for (const Glance& g : f.objects) {
    const auto pixel = run.truth.camera.project(T_CW * g.centre);
    if (!pixel) continue;
    const Box& b = view->box;
    const bool inside =
        pixel->x() >= b.x1 && pixel->x() <= b.x2 && pixel->y() >= b.y1 && pixel->y() <= b.y2;
    if (inside) result.push_back(&g);
  }
  return result;
}

double probabilityOfCar(const Outcome& run, const sim::TruthObject& object, const JournalFrame* f) {
  double most = 0.0;
  if (f == nullptr) return most;
  for (const Glance* g : inImageOf(run, object, *f)) most = std::max(most, g->probability("car"));
  return most;
}

/// Returns the probability 40 frames after the object is first visible, or at the end.
double decidedProbability(const Outcome& run, const sim::TruthObject& object) {
  const TimePoint first = run.truth.frames.at(firstSight(run, object));
  const auto wait = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(kDecided_s));
  return probabilityOfCar(run, object, run.journal.at(frameAt(run, first + wait)));
}

const JournalFrame* lastFrame(const Outcome& run) {
  return run.journal.frames.empty() ? nullptr : &run.journal.frames.back();
}

double height(const Outcome& run, const sim::TruthObject& object, std::uint64_t frame) {
  const sim::TruthView* view = run.viewOf(object, frame);
  return view == nullptr ? 0.0 : view->box.height();
}

/// Returns the largest distance between two camera positions, relative to the first distance from
/// the toy.
double baseline(const Outcome& run, const sim::TruthObject& toy) {
  std::vector<Eigen::Vector3d> places;
  for (const TimePoint t : run.truth.frames) {
    if (const auto T_WB = run.truth.body.at(0, t)) {
      places.push_back((*T_WB * run.truth.camera.T_BC()).p);
    }
  }
  double most = 0.0;
  for (const auto& a : places) {
    for (const auto& b : places) most = std::max(most, (a - b).norm());
  }
  return places.empty() ? 0.0 : most / (toy.keys[0].centre_W - places[0]).norm();
}

/// Error of the distance along the ray, in standard deviations of the belief for this class.
struct Along {
  double deviations = 1e9, relative_sigma = 0.0;
};

Along alongRay(const Outcome& run, const ObjectBelief& belief, const std::string& class_name,
               const Eigen::Vector3d& truth_W) {
  Along best;
  const RigidTransform T = run.toTruth(run.journal.last.stamp.time, run.journal.last.T_WB);
  const Eigen::Vector3d camera = (T * run.journal.last.T_WB * run.truth.camera.T_BC()).p;
  const Eigen::Vector3d ray = (truth_W - camera).normalized();
  for (const ClassBelief& c : belief.classes) {
    if (c.name != class_name) continue;
    const Eigen::Vector3d mean = T * Eigen::Vector3d(c.mean.head<3>());
    const Eigen::Matrix3d P = T.R() * c.covariance.topLeftCorner<3, 3>() * T.R().transpose();
    const double sigma = std::sqrt(ray.dot(P * ray));
    best.deviations = std::abs(ray.dot(mean - truth_W)) / sigma;
    best.relative_sigma = sigma / (mean - camera).norm();
  }
  return best;
}

/// Returns the last belief in the image of an object with the highest existence.
const ObjectBelief* lastBelief(const Outcome& run, const sim::TruthObject& object) {
  const JournalFrame* f = lastFrame(run);
  if (f == nullptr) return nullptr;
  ObjectId id = 0;
  double most = 0.0;
  for (const Glance* g : inImageOf(run, object, *f)) {
    if (g->existence > most) most = g->existence, id = g->id;
  }
  for (const auto& belief : run.journal.last.objects) {
    if (belief.id == id && id != 0) return &belief;
  }
  return nullptr;
}

}  // namespace

Setting withoutSizePrior(Setting setting) {
  const auto file = sceneFolder(setting).string() + ".no_size.yaml";
  std::ofstream stream(file);
  stream << "fallback: {size: [0.7, 0.6, 0.7], spread: [0.4, 0.35, 0.35], common: 0.5}\n"
            "other: {size: [1, 1, 1], spread: [0.35, 0.35, 0.35], common: 0.5, detection: 0.6,\n"
            "        moving: 0.1, speed: 4.0, yaw: false}\n"
            "classes:\n"
            "  car: {size: [1.1, 0.46, 0.4], spread: [0.11, 0.06, 0.075], common: 1.5,\n"
            "        frequency: 2.0, detection: 0.9, moving: 0.2, speed: 8.0}\n";
  setting.assignments.push_back("semantic_filter.class_priors=" + file);
  return setting;
}

Bars toyBars(const Outcome& run, const Outcome& no_size_prior) {
  const auto cars = run.standing("car"), toys = run.standing("toy");
  const sim::TruthObject& toy = toys.at(0);
  const JournalFrame* end = lastFrame(run);
  double car_decided = 1.0, car_end = 1.0, far = 0.0, far_accepted = 0.0;
  for (const auto& car : cars) {
    const double at_end = probabilityOfCar(run, car, end);
    car_decided = std::min(car_decided, decidedProbability(run, car));
    car_end = std::min(car_end, at_end);
    const std::uint64_t first = firstSight(run, car);
    if (height(run, car, first) > 0.9 * height(run, toy, first)) continue;
    far += 1.0;
    far_accepted += at_end >= 0.95 ? 1.0 : 0.0;
  }
  return {atLeast(0.95, "P(car, exists) of the real cars, 40 frames after first detection",
                  car_decided),
          atLeast(0.95, "P(car, exists) of the real cars at the end", car_end),
          atMost(0.05, "P(car, exists) of the toy, 40 frames after first detection",
                 decidedProbability(run, toy)),
          atMost(0.05, "P(car, exists) of the toy at the end", probabilityOfCar(run, toy, end)),
          atLeast(0.3, "baseline travelled, of the toy's distance", baseline(run, toy)),
          atLeast(2, "cars that are smaller in the image than the toy", far),
          atLeast(1.0, "share of the far ones that is accepted at the end",
                  far_accepted / std::max(far, 1.0)),
          atLeast(0.95, "P(car, exists) of the toy at the end without the size prior",
                  probabilityOfCar(no_size_prior, no_size_prior.standing("toy").at(0),
                                   lastFrame(no_size_prior)))};
}

Bars stillBars(const Outcome& run) {
  auto things = run.standing("car");
  const auto cars = things.size();
  things.push_back(run.standing("toy").at(0));
  double least = 1.0, deviations = 0.0, sigma = 1.0;
  for (std::size_t i = 0; i < things.size(); ++i) {
    least = std::min(least, probabilityOfCar(run, things[i], lastFrame(run)));
    const ObjectBelief* belief = lastBelief(run, things[i]);
    const Along along = belief == nullptr ? Along{}
                                          : alongRay(run, *belief, i < cars ? "car" : kOtherClass,
                                                     things[i].keys[0].centre_W);
    deviations = std::max(deviations, along.deviations);
    sigma = std::min(sigma, along.relative_sigma);
  }
  return {
      atLeast(0.05, "P(car, exists), the least of the cars and the toy: nobody is rejected", least),
      atMost(0, "objects that were deleted", number(run.countEvents("gone"))),
      atLeast(0.05, "relative deviation of the distance that is said, the least", sigma),
      atMost(3.0, "deviations between true distance and belief, the most (the toy as other)",
             deviations)};
}

}  // namespace perdure::test
