#include "services/semantic_filter/core/memory/map_alignment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>
#include <unordered_map>

#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kPi = std::numbers::pi;
// m, between the objects of a proposing pair
constexpr double kNearest_m = 4.0, kFarthest_m = 60.0;
constexpr double kGate = 3.0;  // deviations
// deviation of the chance density of objects around those of the map
constexpr double kStreet_m = 6.0;
constexpr std::size_t kMostSeen = 32;
constexpr std::size_t kMostVotes = 50'000;
constexpr std::size_t kCandidates = 48;
constexpr double kCell_m = 3.0, kCell_rad = 5.0 * kPi / 180.0;
// beyond this, an alignment is another one
constexpr double kOther_m = 1.5, kOther_rad = 8.0 * kPi / 180.0;
constexpr double kSure = 0.9;
constexpr double kDefaultShare = 1e-3;  // of a class that one of the two PMFs does not name

double shareOf(const std::vector<ClassNumber>& pmf, const std::string& name) {
  for (const auto& c : pmf)
    if (c.name == name) return c.value;
  return 0.0;
}

const std::string& mostProbable(const PlacedThing& thing) {
  return std::max_element(thing.pmf.begin(), thing.pmf.end(),
                          [](const auto& a, const auto& b) { return a.value < b.value; })
      ->name;
}

/// log of p(one object has both PMFs) against p(two objects have them).
double logSameClass(const PlacedThing& a, const PlacedThing& b,
                    const std::vector<ClassNumber>& common) {
  double ratio = kDefaultShare;
  for (const auto& c : common) {
    if (c.value > 0.0) ratio += shareOf(a.pmf, c.name) * shareOf(b.pmf, c.name) / c.value;
  }
  return std::log(ratio);
}

/// log-likelihood ratio of a yaw known modulo 180°, against any yaw.
double logSameYaw(double difference, double variance) {
  const double d = wrapHalfTurn(difference);
  double density = 0.0;
  for (const double turn : {-kPi, 0.0, kPi}) {
    density += std::exp(-0.5 * (d + turn) * (d + turn) / variance);
  }
  return std::log(std::max(density * std::sqrt(kPi / (2.0 * variance)), 1e-6));
}

bool anotherWay(const LevelPose& a, const LevelPose& b) {
  return (a - b).head<2>().norm() > kOther_m || std::abs(wrapAngle(a[3] - b[3])) > kOther_rad;
}

}  // namespace

MapAlignment::MapAlignment(std::vector<PlacedThing> remembered,
                           const AlignmentParameters& parameters)
    : things_(std::move(remembered)), parameters_(parameters) {
  std::map<std::string, double> common;
  for (const auto& thing : things_) {
    middle_ += thing.p / static_cast<double>(things_.size());
    for (const auto& c : thing.pmf) common[c.name] += c.value / static_cast<double>(things_.size());
  }
  for (const auto& [name, value] : common) common_.push_back({name, value});
  for (std::size_t a = 0; a < things_.size(); ++a) {
    for (std::size_t b = 0; b < things_.size(); ++b) {
      const double distance = (things_[a].p - things_[b].p).head<2>().norm();
      if (a == b || distance < kNearest_m || distance > kFarthest_m) continue;
      pairs_[{mostProbable(things_[a]), mostProbable(things_[b])}].push_back({distance, a, b});
    }
  }
  for (auto& [classes, pairs] : pairs_) {
    std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
      return std::tie(a.distance, a.a, a.b) < std::tie(b.distance, b.a, b.b);
    });
  }
}

class MapAlignment::Search {
 public:
  Search(const MapAlignment& map, std::vector<PlacedThing> seen)
      : map_(map), seen_(std::move(seen)), same_class_(seen_.size() * map.things_.size()) {
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      for (std::size_t k = 0; k < map_.things_.size(); ++k) {
        same_class_[i * map_.things_.size() + k] =
            logSameClass(seen_[i], map_.things_[k], map_.common_);
      }
    }
  }

  std::optional<FrameAlignment> best() {
    struct Way {
      LevelPose x;
      double nats;
    };
    std::vector<Way> ways;
    for (const LevelPose& start : proposals()) {
      const LevelPose x = settled(start);
      ways.push_back({x, nats(x)});
    }
    if (ways.empty()) return std::nullopt;
    std::stable_sort(ways.begin(), ways.end(),
                     [](const Way& a, const Way& b) { return a.nats > b.nats; });
    const Way& first = ways.front();
    const auto next = std::find_if(ways.begin(), ways.end(),
                                   [&](const Way& w) { return anotherWay(w.x, first.x); });
    FrameAlignment alignment = alignmentAt(first.x, map_.middle_);
    alignment.nats = first.nats;
    alignment.next_nats = next == ways.end() ? 0.0 : std::max(next->nats, 0.0);
    AlignmentEquations equations;
    for (const auto& [thing, i] : surePairs(first.x)) {
      equations.add(seen_[i], map_.things_[thing], map_.middle_, first.x);
      alignment.pairs.emplace_back(map_.things_[thing].id, seen_[i].id);
    }
    if (alignment.pairs.size() < 2) return std::nullopt;
    alignment.covariance = equations.covariance();
    return alignment;
  }

 private:
  using PairRange = std::pair<std::vector<Pair>::const_iterator, std::vector<Pair>::const_iterator>;
  struct SeenPair {
    std::size_t a, b;
    PairRange range;  ///< pairs of the map that may be the same
  };
  struct Cell {
    double votes = 0.0;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  };

  double variance(const PlacedThing& thing) const {
    return 0.5 * thing.covariance.topLeftCorner<2, 2>().trace();
  }

  /// Pairs of seen objects; those that resemble fewest pairs of the map come first.
  std::vector<SeenPair> seenPairs() const {
    std::vector<SeenPair> all;
    for (std::size_t a = 0; a < seen_.size(); ++a) {
      for (std::size_t b = a + 1; b < seen_.size(); ++b) {
        const double distance = (seen_[a].p - seen_[b].p).head<2>().norm();
        if (distance < kNearest_m) continue;
        const auto found = map_.pairs_.find({mostProbable(seen_[a]), mostProbable(seen_[b])});
        if (found == map_.pairs_.end()) continue;
        const double slack =
            kGate * std::sqrt(2.0 * (variance(seen_[a]) + variance(seen_[b]))) + 0.3;
        const auto from =
            std::lower_bound(found->second.begin(), found->second.end(), distance - slack,
                             [](const Pair& p, double d) { return p.distance < d; });
        const auto to = std::upper_bound(from, found->second.end(), distance + slack,
                                         [](double d, const Pair& p) { return d < p.distance; });
        if (from != to) all.push_back({a, b, {from, to}});
      }
    }
    std::stable_sort(all.begin(), all.end(), [](const SeenPair& a, const SeenPair& b) {
      return a.range.second - a.range.first < b.range.second - b.range.first;
    });
    return all;
  }

  /// Whether the yaws of a seen object and of one on the map allow this turn.
  bool yawsAgree(const PlacedThing& seen, const PlacedThing& thing, double turn) const {
    const double deviation = std::sqrt(seen.covariance(3, 3) + thing.covariance(3, 3));
    return std::abs(wrapHalfTurn(seen.yaw - thing.yaw - turn)) < kGate * deviation + 0.05;
  }

  std::vector<LevelPose> proposals() const {
    std::unordered_map<std::uint64_t, Cell> cells;
    std::size_t votes = 0;
    for (const SeenPair& pair : seenPairs()) {
      if (votes > kMostVotes) break;
      const PlacedThing &a = seen_[pair.a], &b = seen_[pair.b];
      const Eigen::Vector2d between = (b.p - a.p).head<2>(), middle = 0.5 * (a.p + b.p).head<2>();
      for (auto it = pair.range.first; it != pair.range.second; ++it) {
        const PlacedThing &c = map_.things_[it->a], &d = map_.things_[it->b];
        const Eigen::Vector2d on_map = (d.p - c.p).head<2>();
        const double turn =
            wrapAngle(std::atan2(between.y(), between.x()) - std::atan2(on_map.y(), on_map.x()));
        if (!yawsAgree(a, c, turn) || !yawsAgree(b, d, turn)) continue;
        const Eigen::Vector3d arm = 0.5 * (c.p + d.p) - map_.middle_;
        const Eigen::Vector2d place = middle - (rotationAboutZ(turn) * arm).head<2>();
        Cell& cell = cells[keyOf(place, turn)];
        cell.votes += 1.0;
        cell.middle += place;
        cell.heading += Eigen::Vector2d(std::cos(turn), std::sin(turn));
        ++votes;
      }
    }
    std::vector<std::pair<std::uint64_t, Cell>> most(cells.begin(), cells.end());
    const auto more = [](const auto& a, const auto& b) {
      return a.second.votes > b.second.votes ||
             (a.second.votes == b.second.votes && a.first < b.first);
    };
    const std::size_t count = std::min(kCandidates, most.size());
    std::partial_sort(most.begin(), most.begin() + static_cast<std::ptrdiff_t>(count), most.end(),
                      more);
    most.resize(count);
    std::vector<LevelPose> result;
    for (const auto& [key, cell] : most) {
      LevelPose x;
      x << cell.middle / cell.votes, 0.0, std::atan2(cell.heading.y(), cell.heading.x());
      x[2] = height(x);
      result.push_back(x);
    }
    return result;
  }

  static std::uint64_t keyOf(const Eigen::Vector2d& place, double turn) {
    const auto bits = [](double value) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(value)) & 0xfffff);
    };
    return bits(place.x() / kCell_m) | bits(place.y() / kCell_m) << 20 |
           bits((turn + kPi) / kCell_rad) << 40;
  }

  /// Height of the map's middle at which objects stand as high as those of their class on the map.
  double height(const LevelPose& x) const {
    std::vector<double> heights;
    for (const PlacedThing& seen : seen_) {
      for (const PlacedThing& thing : map_.things_) {
        if (mostProbable(seen) != mostProbable(thing)) continue;
        const Eigen::Vector3d at = x.head<3>() + rotationAboutZ(x[3]) * (thing.p - map_.middle_);
        if ((at - seen.p).head<2>().norm() < kCell_m) {
          heights.push_back(seen.p.z() - (thing.p.z() - map_.middle_.z()));
        }
      }
    }
    if (heights.empty()) return 0.0;
    const auto half = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
    std::nth_element(heights.begin(), half, heights.end());
    return *half;
  }

  struct Likelihood {
    double of_map = 0.0;     ///< density if it is an object of the map
    double by_chance = 0.0;  ///< density of an object there by chance
    std::size_t thing = 0;
    double of_thing = 0.0;
  };

  /// Densities of the object's place on the ground, m⁻². `blur`: m.
  Likelihood likelihoodOf(std::size_t i, const LevelPose& x, double blur) const {
    const PlacedThing& seen = seen_[i];
    const Eigen::Matrix3d R = rotationAboutZ(x[3]);
    const Eigen::Vector3d at = map_.middle_ + R.transpose() * (seen.p - x.head<3>());
    Likelihood l;
    for (std::size_t k = 0; k < map_.things_.size(); ++k) {
      const PlacedThing& thing = map_.things_[k];
      const Eigen::Vector2d off = (at - thing.p).head<2>();
      const double squared = off.squaredNorm();
      if (squared > 16.0 * kStreet_m * kStreet_m) continue;
      l.by_chance +=
          std::exp(-0.5 * squared / (kStreet_m * kStreet_m)) / (2.0 * kPi * kStreet_m * kStreet_m);
      Eigen::Matrix2d S = thing.covariance.topLeftCorner<2, 2>() +
                          R.topLeftCorner<2, 2>().transpose() *
                              seen.covariance.topLeftCorner<2, 2>() * R.topLeftCorner<2, 2>();
      S.diagonal().array() += blur * blur;
      const double determinant = S.determinant();
      const double mahalanobis = (S(1, 1) * off.x() * off.x() - 2.0 * S(0, 1) * off.x() * off.y() +
                                  S(0, 0) * off.y() * off.y()) /
                                 determinant;
      if (mahalanobis > 25.0) continue;
      const double density =
          std::exp(-0.5 * mahalanobis + same_class_[i * map_.things_.size() + k] +
                   logSameYaw(seen.yaw - thing.yaw - x[3],
                              seen.covariance(3, 3) + thing.covariance(3, 3))) /
          (2.0 * kPi * std::sqrt(determinant));
      l.of_map += density;
      if (density > l.of_thing) {
        l.of_thing = density;
        l.thing = k;
      }
    }
    return l;
  }

  /// The most probable map object of a seen one, and its probability.
  std::pair<std::size_t, double> matchOf(std::size_t i, const LevelPose& x, double blur) const {
    const Likelihood l = likelihoodOf(i, x, blur);
    const double w = map_.parameters_.known_share;
    const double all = (1.0 - w) * (l.by_chance + kFloor) + w * l.of_map;
    return {l.thing, w * l.of_thing / all};
  }

  /// Map objects, each with the seen object that it surely is. If two seen objects match one map
  /// object, neither makes a pair: they may be neighbours.
  std::map<std::size_t, std::size_t> surePairs(const LevelPose& x) const {
    std::map<std::size_t, std::size_t> pairs;
    std::set<std::size_t> twice;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const auto [thing, share] = matchOf(i, x, 0.0);
      if (share >= kSure && !pairs.emplace(thing, i).second) twice.insert(thing);
    }
    for (const std::size_t thing : twice) pairs.erase(thing);
    return pairs;
  }

  double nats(const LevelPose& x) const {
    const double w = map_.parameters_.known_share;
    double sum = 0.0;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const Likelihood l = likelihoodOf(i, x, 0.0);
      sum += std::log1p(-w + w * l.of_map / (l.by_chance + kFloor));
    }
    return sum;
  }

  LevelPose settled(LevelPose x) const {
    for (const double blur : {2.0, 1.0, 0.5, 0.2, 0.0, 0.0}) {
      AlignmentEquations equations;
      // a weak prior at the present estimate
      equations.information.diagonal() << 1e-2, 1e-2, 1e-2, 1e-1;
      for (std::size_t i = 0; i < seen_.size(); ++i) {
        const auto [thing, share] = matchOf(i, x, blur);
        if (share < 0.1) continue;
        equations.add(seen_[i], map_.things_[thing], map_.middle_, x, share, blur);
      }
      if (equations.weights == 0.0) break;
      x += equations.step();
      x[3] = wrapAngle(x[3]);
    }
    return x;
  }

  /// m⁻²; density where the map has no objects: one in a disc of 100 m radius.
  static constexpr double kFloor = 1.0 / (kPi * 100.0 * 100.0);

  const MapAlignment& map_;
  std::vector<PlacedThing> seen_;
  std::vector<double> same_class_;  ///< log ratios, by seen and map object
};

std::optional<FrameAlignment> MapAlignment::best(const std::vector<PlacedThing>& seen) const {
  std::vector<PlacedThing> placed = seen;
  const auto spread = [](const PlacedThing& s) {
    return s.covariance.topLeftCorner<2, 2>().trace();
  };
  std::stable_sort(placed.begin(), placed.end(), [&](const PlacedThing& a, const PlacedThing& b) {
    return spread(a) < spread(b);
  });
  if (placed.size() > kMostSeen) placed.resize(kMostSeen);
  return Search(*this, std::move(placed)).best();
}

std::optional<FrameAlignment> MapAlignment::align(const std::vector<PlacedThing>& seen) const {
  const auto found = best(seen);
  if (!found || found->pairs.size() < static_cast<std::size_t>(parameters_.pairs) ||
      found->nats < parameters_.nats || found->nats - found->next_nats < parameters_.margin_nats) {
    return std::nullopt;
  }
  return found;
}

}  // namespace perdure::semantic_filter
