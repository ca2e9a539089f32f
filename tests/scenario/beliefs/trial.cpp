#include "tests/scenario/beliefs/trial.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/node.h"

namespace perdure::test {
namespace {

using namespace semantic_filter;  // NOLINT

// An object matches a true object if each side of its box differs by less than this share of the
// extent plus this number of pixels.
constexpr double kOfExtent = 0.25, kPixels = 3.0;
// An object loses its match after this number of frames in view without the true object's image.
constexpr std::uint64_t kForgotten = 5;
constexpr double kLeastExistence = 0.05;  // lowest existence of a sampled object
constexpr double kOldestAge = 60.0;       // frames
constexpr std::uint32_t kLeastVisible = 20;
constexpr double kOutlier = 25.0;  // limit of the squared normalised error

/// Returns the distance of two boxes; below 1, they may belong to the same true object.
double apartness(const Box& a, const Box& b) {
  const double x = kPixels + kOfExtent * b.width(), y = kPixels + kOfExtent * b.height();
  return std::max({std::abs(a.x1 - b.x1) / x, std::abs(a.x2 - b.x2) / x, std::abs(a.y1 - b.y1) / y,
                   std::abs(a.y2 - b.y2) / y});
}

/// Data about an object besides its belief.
struct Followed {
  std::optional<std::size_t> thing;
  std::uint64_t frames_without = 0;
  std::uint64_t asked_at = 0;  ///< frame
  bool asked = false;
};

class Trial {
 public:
  Trial(const WorldOptions& options, const Told& told)
      : options_(options),
        world_(options, told),
        dice_(sim::seedOf("ages", {options.seed})),
        visible_(world_.things().size(), 0),
        node_(told.config, told.priors, 9, {[this](const Objects& m) { last_ = m; }, {}, {}}) {
    Calibration calibration;
    calibration.cameras.push_back(world_.camera().calibration());
    node_.onCalibration(calibration);
    node_.onModel(world_.model());
  }

  BeliefScores run() {
    for (std::uint64_t k = 0; k < options_.frames; ++k) {
      const WorldFrame frame = world_.next();
      countBoxes(frame);
      node_.onOdometry(frame.odometry);
      node_.onDetections(frame.detections);
      node_.flush();
      for (std::size_t i = 0; i < visible_.size(); ++i)
        visible_[i] += frame.visibilities[i].fraction > 0;
      applyCorrection(frame);
      ask(k, frame.t_s);
    }
    compareGaussians();
    scores_.things = world_.things().size();
    for (const auto n : visible_) scores_.seen_things += n > 0;
    return std::move(scores_);
  }

 private:
  /// For `initiation.odds`: counts boxes of true objects without a track, and false boxes.
  void countBoxes(const WorldFrame& frame) {
    std::vector<bool> known(visible_.size(), false);
    for (const auto& o : last_.objects) {
      const auto& thing = followed_[o.id].thing;
      if (thing) known[*thing] = true;
    }
    for (const int origin : frame.origins) {
      if (origin < 0) {
        ++scores_.false_boxes;
      } else if (!known[static_cast<std::size_t>(origin)]) {
        ++scores_.new_boxes;
      }
    }
  }

  /// Matches objects with true objects one to one, by the smallest distance of their boxes.
  void applyCorrection(const WorldFrame& frame) {
    struct Pair {
      double apart;
      ObjectId id;
      std::size_t thing;
    };
    std::vector<Pair> pairs;
    View view = frame.true_view;
    view.T_WB = frame.odometry.T_WB;
    for (const auto& o : last_.objects) {
      auto [it, fresh] = followed_.try_emplace(o.id);
      if (fresh) {
        const double age = std::floor(std::exp(dice_.uniform(0.0, std::log(kOldestAge))) - 1.0);
        it->second.asked_at = frame.odometry.stamp.sequence + static_cast<std::uint64_t>(age);
      }
      if (o.visible_fraction <= 0.0) continue;
      ++it->second.frames_without;
      const auto image = imageOf(o, view);
      if (!image) continue;
      for (std::size_t i = 0; i < frame.outlines.size(); ++i) {
        if (!frame.outlines[i]) continue;
        const double apart = apartness(*image, *frame.outlines[i]);
        if (apart < 1.0) pairs.push_back({apart, o.id, i});
      }
    }
    std::sort(pairs.begin(), pairs.end(),
              [](const Pair& a, const Pair& b) { return a.apart < b.apart; });
    std::map<ObjectId, bool> taken;
    std::vector<bool> used(frame.outlines.size(), false);
    for (const Pair& pair : pairs) {
      if (taken[pair.id] || used[pair.thing]) continue;
      taken[pair.id] = used[pair.thing] = true;
      followed_[pair.id].thing = pair.thing;
      followed_[pair.id].frames_without = 0;
    }
    for (auto& [id, f] : followed_) {
      if (f.frames_without > kForgotten) f.thing.reset();
    }
  }

  static std::optional<Box> imageOf(const ObjectBelief& o, const View& view) {
    State x = State::Zero();
    x.head<7>() = o.best().mean;
    const auto p = projectObserved(x, view, BoxStyle());
    if (!p) return std::nullopt;
    const double W = view.camera->width(), H = view.camera->height();
    return Box{std::clamp(p->sides[0], 0.0, W), std::clamp(p->sides[1], 0.0, H),
               std::clamp(p->sides[2], 0.0, W), std::clamp(p->sides[3], 0.0, H)};
  }

  void ask(std::uint64_t frame, double t_s) {
    for (const auto& o : last_.objects) {
      Followed& f = followed_[o.id];
      if (f.asked || frame < f.asked_at) continue;
      f.asked = true;
      if (o.existence <= kLeastExistence) continue;
      const bool there = f.thing && world_.present(*f.thing, t_s);
      scores_.existence.claims.push_back({o.existence, there});
      if (!there) continue;
      tools::ClassClaim claim;
      for (const auto& c : o.classes) claim.believed[c.name] = c.probability;
      claim.is = world_.things()[*f.thing].class_name;
      scores_.classes.claims.push_back(std::move(claim));
    }
  }

  void compareGaussians() {
    BeliefScores& s = scores_;
    for (const auto& o : last_.objects) {
      const Followed& f = followed_[o.id];
      if (!o.confirmed || !f.thing || visible_[*f.thing] < kLeastVisible) continue;
      const Thing& thing = world_.things()[*f.thing];
      if (thing.moves()) continue;
      ++s.objects;
      if (o.best().name != thing.class_name) {
        ++s.wrong_class;
        continue;
      }
      Vector7d e = o.best().mean - thing.x.head<7>();
      e[3] = 0.5 * wrapAngle(2.0 * e[3]);
      const Matrix7d& P = o.best().covariance;
      const auto nees = [&](Eigen::Index at) {
        const Eigen::Vector3d part = e.segment<3>(at);
        return squaredMahalanobis(part, P.block<3, 3>(at, at));
      };
      const double position = nees(0), half_yaw = e[3] * e[3] / P(3, 3), size = nees(4);
      s.all_position.nees.push_back(position);
      s.all_half_yaw.nees.push_back(half_yaw);
      s.all_size.nees.push_back(size);
      if (std::max({position, half_yaw, size}) < kOutlier) continue;
      s.outliers.push_back({options_.seed, o.id, o.best().name, position, half_yaw, size,
                            e.head<3>().norm(), e[3], std::sqrt(P(3, 3)),
                            thing.x.segment<3>(4).array().exp(),
                            o.best().mean.segment<3>(4).array().exp(), o.hits, o.visible_misses});
    }
    s.position.add(s.all_position);
    s.half_yaw.add(s.all_half_yaw);
    s.size.add(s.all_size);
  }

  WorldOptions options_;
  World world_;
  sim::Dice dice_;
  std::vector<std::uint32_t> visible_;
  Objects last_;
  Node node_;
  std::map<ObjectId, Followed> followed_;
  BeliefScores scores_;
};

template <class List>
void append(List& to, const List& from) {
  to.insert(to.end(), from.begin(), from.end());
}

void print(const tools::RunAnees& runs, const tools::Anees& all) {
  const auto [low, high] = runs.band();
  std::printf("%-18s %6zu %6.2f ± %.2f   %.2f .. %.2f %9.2f %10.3f\n", runs.what.c_str(),
              all.nees.size(), runs.mean(), runs.standardError(), low, high, all.median(),
              all.within3Sigma());
}

void print(const tools::Reliability& r) {
  std::printf("\n%s: %zu asked, calibration error %.3f, Brier %.3f, skill %.2f\n", r.what.c_str(),
              r.claims.size(), r.calibrationError(), r.brier(), r.skill());
  for (const auto& bin : r.bins()) {
    std::printf("  %6zu  believed %.3f  so %.3f\n", bin.count, bin.believed, bin.observed);
  }
}

}  // namespace

void BeliefScores::add(const BeliefScores& world) {
  append(position.means, world.position.means);
  append(half_yaw.means, world.half_yaw.means);
  append(size.means, world.size.means);
  append(all_position.nees, world.all_position.nees);
  append(all_half_yaw.nees, world.all_half_yaw.nees);
  append(all_size.nees, world.all_size.nees);
  append(existence.claims, world.existence.claims);
  append(classes.claims, world.classes.claims);
  things += world.things;
  seen_things += world.seen_things;
  objects += world.objects;
  wrong_class += world.wrong_class;
  new_boxes += world.new_boxes;
  false_boxes += world.false_boxes;
  append(outliers, world.outliers);
}

BeliefScores runWorld(const WorldOptions& options, const Told& told) {
  return Trial(options, told).run();
}

BeliefScores runWorlds(WorldOptions options, const Told& told, std::size_t runs) {
  BeliefScores all;
  for (std::size_t i = 0; i < runs; ++i, ++options.seed) all.add(runWorld(options, told));
  return all;
}

void print(const BeliefScores& s) {
  std::printf("%zu things, %zu seen; a new box for %.1f false ones\n", s.things, s.seen_things,
              double(s.false_boxes) / double(std::max<std::size_t>(s.new_boxes, 1)));
  std::printf("%zu confirmed with 20 visible frames, %zu of a wrong class\n\n", s.objects,
              s.wrong_class);
  std::printf("%-18s %6s %13s %14s %9s %10s\n", "", "number", "NEES per dof", "95 % band", "median",
              "in 3 sigma");
  print(s.position, s.all_position);
  print(s.half_yaw, s.all_half_yaw);
  print(s.size, s.all_size);
  print(s.existence);
  print(s.classes.best());
  std::printf("all classes: Brier %.3f, skill %.2f\n", s.classes.brier(), s.classes.skill());
}

void print(std::vector<Outlier> outliers) {
  const auto most = [](const Outlier& o) { return std::max({o.position, o.half_yaw, o.size}); };
  std::sort(outliers.begin(), outliers.end(),
            [&](const Outlier& a, const Outlier& b) { return most(a) > most(b); });
  std::printf("\n%6s %5s %-13s %8s %8s %8s %6s %7s %7s  %-16s %-16s %5s %6s\n", "world", "id",
              "class", "position", "yaw", "size", "m off", "turned", "said", "true size",
              "believed", "hits", "misses");
  for (const Outlier& o : outliers) {
    const auto& t = o.true_size;
    const auto& b = o.believed_size;
    std::printf(
        "%6llu %5llu %-13s %8.1f %8.1f %8.1f %6.2f %7.3f %7.3f  %4.2f %4.2f %4.2f   "
        "%4.2f %4.2f %4.2f   %5u %6u\n",
        static_cast<unsigned long long>(o.world), static_cast<unsigned long long>(o.id),
        o.class_name.c_str(), o.position, o.half_yaw, o.size, o.apart_m, o.turned, o.sigma_yaw,
        t[0], t[1], t[2], b[0], b[1], b[2], o.hits, o.misses);
  }
}

}  // namespace perdure::test
