// Compares a route chosen by expected information with the shortest tour of the same length: how
// many of thirty changes each finds, in towns that were mapped before. The map, and the finding of
// changes, are those of the filter and the map store.
// usage: look_bench [FIRST_SEED [SEEDS [METRES]]] (default: 101, 10, 1200). The status is 1 if ten
// or more towns give less than 30 % more changes.
#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>

#include "services/map_store/node.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/planning/places.h"
#include "tests/bench/look_bench/town.h"
#include "tests/services/map_store/beliefs.h"
#include "tools/map/look.h"

namespace {

using namespace perdure;
using namespace perdure::semantic_filter;
using namespace perdure::semantic_filter::bench;

constexpr double kPause_s = 900.0, kLast_s = 600.0;  // between trips; before the look
constexpr int kTrips = 4, kStart = kNodes * (kNodes / 2) + kNodes / 2;
constexpr double kTrip_m = 900.0;
constexpr double kPast_m = 10.0, kPlan_m = 5.0;  // distances of past and of planned views
constexpr double kAt_m = 2.0;                    // an object is at a place if it is nearer

struct Change {
  std::optional<Eigen::Vector2d> removed, added;
};

/// Filter and map store on a map's file, with the newest state of all published objects.
class Vehicle {
 public:
  Vehicle(const std::string& file, std::uint64_t first_frame)
      : frame_(first_frame),
        store_(config(file), 6,
               {[](auto&) {}, [](auto&) {}, [](auto&) {}, [](auto&) {},
                [this](const MapNear& m) { near_.push_back(m); }}),
        filter_({}, testing::makePriors(), 10,
                {.objects = [this](const Objects& m) { objects_.push_back(m); },
                 .events = [this](const Event& e) { onEvent(e); },
                 .predictions = {}}) {
    filter_.onCalibration(testing::calibrationOf(testing::makeCamera()));
    filter_.onModel(testing::makeModelInfo());
  }

  void drive(Town& town, const std::vector<TimedView>& views, std::mt19937& random) {
    const CameraModel camera{testing::makeCamera()};
    for (const TimedView& view : views) {
      ++frame_;
      Odometry odometry = testing::odometryAt(frame_, view.T_WB);
      Detections detections = testing::detectionsAt(frame_, see(town, view, camera, random));
      odometry.stamp.time = detections.stamp.time = view.time;
      filter_.onOdometry(odometry);
      filter_.onDetections(detections);
      for (const Objects& m : std::exchange(objects_, {})) {
        for (const ObjectBelief& o : m.objects) now_[o.id] = o;
        store_.onObjects(m);
      }
      store_.tick(view.time.time_since_epoch());
      for (const MapNear& m : std::exchange(near_, {})) filter_.onNear(m);
    }
    filter_.flush();
    store_.flush();
  }
  std::uint64_t frame() const { return frame_; }
  const std::map<ObjectId, ObjectBelief>& published() const { return now_; }
  const std::set<ObjectId>& ended() const { return ended_; }

 private:
  static map_store::Config config(const std::string& file) {
    map_store::Config config;
    config.store_path = file;
    config.check_at_start = false;
    config.commit_period_s = 5.0;
    return config;
  }
  void onEvent(const Event& e) {
    if (e.kind == EventKind::kGone) ended_.insert(e.object_id);
    if (e.kind == EventKind::kMerged) ended_.insert(e.other_id);
  }

  std::uint64_t frame_;
  std::vector<Objects> objects_;
  std::vector<MapNear> near_;
  std::map<ObjectId, ObjectBelief> now_;
  std::set<ObjectId> ended_;
  map_store::Node store_;
  Node filter_;
};

/// Returns the index of one parking place, by weight; the weight of a chosen place is 0 then.
std::size_t choose(std::vector<double>& weights, std::mt19937& random) {
  const auto k = std::discrete_distribution<std::size_t>(weights.begin(), weights.end())(random);
  weights[k] = 0.0;
  return k;
}

/// Changes the town at the rates of the survival model since each place was last in view: ten cars
/// leave, ten arrive, ten move within their street.
std::vector<Change> changeTown(Town& town, double now_s, const MotionParameters& motion,
                               std::mt19937& random) {
  auto& parking = town.parking();
  std::vector<double> leave, arrive;
  for (const Parking& p : parking) {
    const double changed = 1.0 - std::exp(-(now_s - p.seen_s) / motion.survival_s);
    leave.push_back(p.taken ? changed : 0.0);
    arrive.push_back(p.taken ? 0.0 : changed * town.streets()[p.street].occupancy);
  }
  std::vector<Change> changes;
  const auto placeOf = [&](std::size_t k) { return Eigen::Vector2d(parking[k].car.head<2>()); };
  for (int i = 0; i < 20; ++i) {
    const std::size_t from = choose(leave, random);
    Change change{placeOf(from), {}};
    parking[from].taken = false;
    if (i >= 10) {
      std::vector<double> there(parking.size(), 0.0);
      for (std::size_t k = 0; k < parking.size(); ++k) {
        const bool same = parking[k].street == parking[from].street;
        if (same && arrive[k] > 0.0 && (placeOf(k) - *change.removed).norm() > 8.0) there[k] = 1.0;
      }
      if (std::any_of(there.begin(), there.end(), [](double w) { return w > 0.0; })) {
        const std::size_t to = choose(there, random);
        parking[to].taken = true;
        arrive[to] = 0.0;
        change.added = placeOf(to);
      }
    }
    changes.push_back(change);
  }
  for (int i = 0; i < 10; ++i) {
    const std::size_t to = choose(arrive, random);
    parking[to].taken = true;
    changes.push_back({{}, placeOf(to)});
  }
  return changes;
}

bool isAt(const ObjectBelief& o, const Eigen::Vector2d& place) {
  return (o.best().mean.head<2>() - place).norm() < kAt_m;
}

struct Found {
  int changes = 0, removed = 0, added = 0;
};

/// Counts the changes that the map after a drive has. `before`: the map before it.
Found countFound(const std::vector<Change>& changes, const std::vector<ObjectBelief>& before,
                 const Vehicle& vehicle) {
  std::map<ObjectId, ObjectBelief> after;
  for (const ObjectBelief& o : before) after[o.id] = o;
  for (const auto& [id, o] : vehicle.published()) after[id] = o;
  for (const ObjectId id : vehicle.ended()) after.erase(id);
  const auto has = [&](const Eigen::Vector2d& place) {
    return std::any_of(after.begin(), after.end(), [&](const auto& entry) {
      const ObjectBelief& o = entry.second;
      return o.existence >= 0.5 && isAt(o, place);
    });
  };
  const auto had = [&](const Eigen::Vector2d& place) {
    return std::any_of(before.begin(), before.end(), [&](const auto& o) { return isAt(o, place); });
  };
  Found found;
  for (const Change& change : changes) {
    const bool removed = change.removed && had(*change.removed) && !has(*change.removed);
    const bool added = change.added && !had(*change.added) && has(*change.added);
    found.removed += removed, found.added += added;
    found.changes += removed || added ? 1 : 0;
  }
  return found;
}

using Streets = std::bitset<4 * kNodes * kNodes>;  // two bits a street, one for each direction

/// The information of each street in each direction, alone and after the other direction.
class Worth {
 public:
  Worth(const Town& town, const std::vector<Candidate>& candidates, const Observer& observer,
        double now_s)
      : town_(town) {
    for (const Street& s : town.streets()) {
      const auto there = posesOf({s.a, s.b}, kPlan_m, now_s),
                 back = posesOf({s.b, s.a}, kPlan_m, now_s);
      auto both = there;
      both.insert(both.end(), back.begin(), back.end());
      const double a = bits(candidates, there, observer), b = bits(candidates, back, observer);
      const double joint = bits(candidates, both, observer);
      alone_.push_back({a, b});
      after_.push_back({joint - b, joint - a});
    }
  }
  /// Returns the bits of walking from `a` to `b`, and marks it in `walked`.
  double of(int a, int b, Streets& walked) const {
    const std::size_t s = *town_.streetBetween(a, b);
    const std::size_t direction = town_.streets()[s].a == a ? 0 : 1;
    const std::size_t this_way = 2 * s + direction, other_way = 2 * s + 1 - direction;
    if (walked[this_way]) return 0.0;
    walked[this_way] = true;
    return walked[other_way] ? after_[s][direction] : alone_[s][direction];
  }

 private:
  static double bits(const std::vector<Candidate>& candidates, const std::vector<TimedView>& views,
                     const Observer& observer) {
    double sum = 0.0;
    for (const Expectation& e : expect(candidates, views, observer)) {
      sum += e.fall.existence + e.fall.unseen;
    }
    return sum;
  }

  const Town& town_;
  std::vector<std::array<double, 2>> alone_, after_;
};

/// Returns the walk with the most bits, by beam search over the streets.
Walk bestWalk(const Town& town, const Worth& worth, int start, double metres) {
  constexpr std::size_t kBeam = 500;
  struct Partial {
    double bits;
    Walk walk;
    Streets walked;
  };
  std::vector<Partial> beam{{0.0, {start}, {}}};
  for (double length = 0.0; length + kBlock_m <= metres; length += kBlock_m) {
    std::vector<Partial> next;
    for (const Partial& p : beam) {
      for (const int n : town.adjacentTo(p.walk.back())) {
        Partial longer = p;
        longer.bits += worth.of(p.walk.back(), n, longer.walked);
        longer.walk.push_back(n);
        next.push_back(std::move(longer));
      }
    }
    std::stable_sort(next.begin(), next.end(),
                     [](const auto& a, const auto& b) { return a.bits > b.bits; });
    beam.clear();
    std::set<std::pair<int, std::string>> known;
    for (Partial& p : next) {
      if (beam.size() == kBeam) break;
      if (known.emplace(p.walk.back(), p.walked.to_string()).second) beam.push_back(std::move(p));
    }
  }
  return beam.front().walk;
}

struct Comparison {
  Found tour, look;
};

Comparison compare(std::uint64_t seed, double metres) {
  std::mt19937 random(static_cast<std::uint32_t>(1000 + seed));
  const map_store::test::TemporaryFolder folder;
  const std::string file = folder.file("map.sqlite");
  Town town(seed);
  const Walk tour = shortestTour(town, kStart, random);
  double now_s = 0.0;
  std::vector<TimedView> past;
  Walk trip = tour;
  std::uint64_t frame = 0;
  {
    Vehicle vehicle(file, 0);
    for (int k = 0;; ++k) {
      vehicle.drive(town, posesOf(trip, kFrame_m, now_s), random);
      const auto seen = posesOf(trip, kPast_m, now_s);
      past.insert(past.end(), seen.begin(), seen.end());
      now_s += lengthOf(trip) / kSpeed + 60.0;
      if (k == kTrips) break;
      now_s += kPause_s;
      trip = wander(town, trip.back(), kTrip_m, random);
    }
    frame = vehicle.frame();
  }
  now_s += kLast_s;
  const Parameters parameters;
  const auto changes = changeTown(town, now_s, parameters.motion, random);

  tools::MapToLook map = tools::readMapToLook(file);
  map.past = std::move(past);
  const CameraModel camera{testing::makeCamera()};
  const ClassPriors priors = testing::makePriors();
  const Observer observer{&camera, &priors, &parameters, natsPerHit(map.beliefs)};
  std::vector<TimedView> planned;
  for (const Street& s : town.streets()) {
    for (const Walk& walk : {Walk{s.a, s.b}, Walk{s.b, s.a}}) {
      const auto views = posesOf(walk, kPlan_m, now_s);
      planned.insert(planned.end(), views.begin(), views.end());
    }
  }
  const auto candidates = tools::candidatesOf(map, planned, observer);
  const Worth worth(town, candidates, observer, now_s);
  const Walk chosen = bestWalk(town, worth, kStart, metres);
  const Walk cut(tour.begin(), tour.begin() + static_cast<std::ptrdiff_t>(chosen.size()));

  Comparison result;
  for (const auto& [walk, found] : {std::pair{&cut, &result.tour}, {&chosen, &result.look}}) {
    const std::string copy = folder.file("copy.sqlite");
    std::filesystem::copy_file(file, copy, std::filesystem::copy_options::overwrite_existing);
    std::mt19937 noise(static_cast<std::uint32_t>(seed));
    Vehicle vehicle(copy, frame);
    vehicle.drive(town, posesOf(*walk, kFrame_m, now_s), noise);
    *found = countFound(changes, map.beliefs, vehicle);
  }
  std::printf(
      "seed %3llu: map %zu of %zu cars, tour of all %.0f m; found in %.0f m: tour %d "
      "(%d removed, %d added), look %d (%d removed, %d added)\n",
      static_cast<unsigned long long>(seed), map.beliefs.size(),
      static_cast<std::size_t>(std::count_if(town.parking().begin(), town.parking().end(),
                                             [](const Parking& p) { return p.taken; })),
      lengthOf(tour), lengthOf(chosen), result.tour.changes, result.tour.removed, result.tour.added,
      result.look.changes, result.look.removed, result.look.added);
  std::fflush(stdout);
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const auto first = static_cast<std::uint64_t>(argc > 1 ? std::atoll(argv[1]) : 101);
  const auto seeds = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 10);
  const double metres = argc > 3 ? std::atof(argv[3]) : 1200.0;
  double tour = 0.0, look = 0.0, square = 0.0;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    const Comparison r = compare(seed, metres);
    const double more = r.look.changes - r.tour.changes;
    tour += r.tour.changes, look += r.look.changes, square += more * more;
  }
  const double n = static_cast<double>(seeds), mean = (look - tour) / n;
  const double spread =
      n > 1.0 ? std::sqrt(std::max(0.0, square - n * mean * mean) / (n - 1.0)) : 0;
  std::printf(
      "%llu towns: tour %.1f, look %.1f of 30 changes (%+.0f %%); difference %.1f, standard "
      "deviation %.1f\n",
      static_cast<unsigned long long>(seeds), tour / n, look / n, 100.0 * (look / tour - 1.0), mean,
      spread);
  return seeds < 10 || look >= 1.3 * tour ? 0 : 1;
}
