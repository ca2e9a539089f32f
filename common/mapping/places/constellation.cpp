#include "common/mapping/places/constellation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <unordered_map>
#include <utility>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kGate = 3.0;      // gate, in standard deviations of a pair's distance or yaw
constexpr double kStreet_m = 6.0;  // spread of the chance density around map objects
constexpr double kReach_m = MapIndex::kReach_m;
// Chance density far from the map's objects, m⁻²: one object in a disc of 100 m radius.
constexpr double kFloor = 1.0 / (kPi * 100.0 * 100.0);
// Distance within which observed objects are one group, for example a table, its chairs and the
// monitors on it. Such groups look alike in all rooms.
constexpr double kGroup_m = 1.0;
// Differences of an object's estimates between two visits that their covariances do not contain.
constexpr double kRepeat_m = 0.1, kRepeat_rad = 0.1;
constexpr double kCell_m = 2.0, kCell_rad = 4.0 * kPi / 180.0;
constexpr std::size_t kMostSeen = 48, kMostVotes = 250'000, kCandidates = 128;
constexpr std::size_t kMostCells = 4096;  // largest number of cells from which candidates are
                                          // chosen
// Two poses are different if they are farther apart than one of these limits.
constexpr double kOther_m = 1.5, kOther_rad = 8.0 * kPi / 180.0;
constexpr double kSure = 0.9;
constexpr double kDefaultShare = 1e-3;  // share of a class that one of the two PMFs lacks

/// Log-likelihood ratio of equal yaws, known modulo 180°, against an arbitrary yaw.
double logSameYaw(double difference, double variance) {
  const double d = wrapHalfTurn(difference);
  double density = 0.0;
  for (const double turn : {-kPi, 0.0, kPi}) {
    density += std::exp(-0.5 * (d + turn) * (d + turn) / variance);
  }
  return std::log(std::max(density * std::sqrt(kPi / (2.0 * variance)), 1e-6));
}

bool anotherWay(const LevelPose& a, const LevelPose& b) {
  return (a.p - b.p).head<2>().norm() > kOther_m || std::abs(wrapAngle(a.yaw - b.yaw)) > kOther_rad;
}

class Search {
 public:
  Search(std::vector<PlacedObject> seen, const MapIndex& map, const LevelGaussian& prior,
         const PlaceParameters& parameters)
      : parameters_(parameters),
        prior_(prior),
        seen_(std::move(seen)),
        index_(map),
        map_(map.objects()),
        prior_information_(inverseSymmetric(prior_.covariance)) {
    keepTheSurest();
    weighGroups();
    weighClasses();
  }

  std::optional<PlaceMatch> best() const {
    struct Way {
      LevelPose x;
      double score;
    };
    std::vector<Way> ways;
    for (const LevelPose& start : proposals()) {
      const LevelPose x = settled(start);
      ways.push_back({x, scoreOf(x)});
    }
    if (ways.empty()) return std::nullopt;
    std::stable_sort(ways.begin(), ways.end(),
                     [](const Way& a, const Way& b) { return a.score > b.score; });
    const Way& first = ways.front();
    const auto next = std::find_if(ways.begin(), ways.end(),
                                   [&](const Way& w) { return anotherWay(w.x, first.x); });
    PlaceMatch match;
    match.T_MB.mean = first.x;
    match.score = first.score;
    match.cells = cells();
    match.next = std::max(next == ways.end() ? -1e9 : next->score, scoreOfNone());
    MatchEquations equations;
    for (const auto& [k, i] : surePairs(first.x)) {
      equations.add(seen_[i], map_[k], first.x, 1.0, 0.0);
      match.pairs.emplace_back(map_[k].id, seen_[i].id);
    }
    if (match.pairs.empty()) return std::nullopt;
    // The covariance uses the pairs alone. In directions with little information, the mean stays
    // near the prior.
    const Eigen::Vector4d step =
        equations.stepNear(prior_information_, difference(prior_.mean, first.x));
    match.T_MB.mean.p += step.head<3>();
    match.T_MB.mean.yaw = wrapAngle(match.T_MB.mean.yaw + step[3]);
    match.T_MB.covariance = equations.covariance();
    return match;
  }

 private:
  struct Cell {
    double votes = 0.0;
    Eigen::Vector2d place = Eigen::Vector2d::Zero();
    Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  };
  using Cells = std::unordered_map<std::uint64_t, Cell>;

  void keepTheSurest() {
    std::stable_sort(seen_.begin(), seen_.end(), [](const PlacedObject& a, const PlacedObject& b) {
      return planeVariance(a) < planeVariance(b);
    });
    if (seen_.size() > kMostSeen) seen_.resize(kMostSeen);
  }

  /// Computes the share of each observed object in the evidence of its group.
  void weighGroups() {
    for (const PlacedObject& o : seen_) {
      double members = 0.0;
      for (const PlacedObject& other : seen_) {
        const double squared = (other.p - o.p).head<2>().squaredNorm();
        members += std::exp(-0.5 * squared / (kGroup_m * kGroup_m));
      }
      group_shares_.push_back(1.0 / members);
    }
  }

  /// Computes the probability of each class of each observed object, divided by the share of the
  /// class on the map.
  void weighClasses() {
    for (const PlacedObject& o : seen_) {
      std::vector<double>& weights = class_weights_.emplace_back();
      for (const ClassShare& c : o.pmf) {
        const double share = index_.commonShare(c.name);
        if (share <= 0.0) continue;
        if (weights.size() <= c.name) weights.resize(c.name + 1, 0.0);
        weights[c.name] = c.probability / share;
      }
    }
  }

  /// Likelihood ratio of the two PMFs: one object against two objects.
  double sameClass(std::size_t i, std::size_t k) const {
    const std::vector<double>& weights = class_weights_[i];
    double ratio = kDefaultShare;
    for (const ClassShare& c : map_[k].pmf) {
      if (c.name < weights.size()) ratio += weights[c.name] * c.probability;
    }
    return ratio;
  }

  double deviations2(const LevelPose& x) const {
    const LevelError d = difference(x, prior_.mean);
    return d.dot(prior_information_ * d);
  }

  bool insidePrior(const LevelPose& x) const {
    const LevelError d = difference(x, prior_.mean);
    const auto g = parameters_.gate_sigmas;
    const double plane =
        prior_.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff() + kCell_m * kCell_m;
    return d.head<2>().squaredNorm() < g * g * 2.0 * plane &&
           std::abs(d[3]) < g * std::sqrt(prior_.covariance(3, 3)) + kCell_rad;
  }

  /// Number of distinguishable poses inside the prior, in cells of 1 m by 1 m by 3°.
  double cells() const {
    constexpr double kDistinct_m = 1.0, kDistinct_rad = 3.0 * kPi / 180.0;
    const double area =
        2.0 * kPi * std::sqrt(std::max(prior_.covariance.topLeftCorner<2, 2>().determinant(), 0.0));
    const double turn = std::min(std::sqrt(2.0 * kPi * prior_.covariance(3, 3)), 2.0 * kPi);
    return std::max(1.0, area / (kDistinct_m * kDistinct_m)) * std::max(1.0, turn / kDistinct_rad);
  }

  bool yawsAgree(const PlacedObject& seen, const PlacedObject& known, double turn) const {
    const double deviation = std::sqrt(seen.covariance(3, 3) + known.covariance(3, 3));
    return std::abs(wrapHalfTurn(known.yaw - seen.yaw - turn)) < kGate * deviation + 0.05;
  }

  void vote(Cells& cells, const LevelPose& x, double votes) const {
    if (!insidePrior(x)) return;
    const auto bits = [](double value) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(value)) & 0xfffff);
    };
    Cell& cell = cells[bits(x.p.x() / kCell_m) | bits(x.p.y() / kCell_m) << 20 |
                       bits((x.yaw + kPi) / kCell_rad) << 40];
    cell.votes += votes;
    cell.place += votes * x.p.head<2>();
    cell.heading += votes * Eigen::Vector2d(std::cos(x.yaw), std::sin(x.yaw));
  }

  /// Adds votes for each pair of observed objects and each similar pair of the map. Stops at
  /// kMostVotes.
  void votePairs(Cells& cells) const {
    struct SeenPair {
      std::size_t a, b;
      std::vector<MapIndex::Pair>::const_iterator from, to;
    };
    std::vector<SeenPair> all;
    for (std::size_t a = 0; a < seen_.size(); ++a) {
      for (std::size_t b = a + 1; b < seen_.size(); ++b) {
        const double distance = (seen_[a].p - seen_[b].p).head<2>().norm();
        if (distance < parameters_.pair_least_m || distance > parameters_.pair_most_m) continue;
        const auto* like = index_.pairsOf(mostProbable(seen_[a]), mostProbable(seen_[b]));
        if (like == nullptr) continue;
        const double slack =
            kGate * std::sqrt(2.0 * (planeVariance(seen_[a]) + planeVariance(seen_[b]))) + 0.3;
        const auto from =
            std::lower_bound(like->begin(), like->end(), distance - slack,
                             [](const MapIndex::Pair& p, double d) { return p.distance < d; });
        const auto to =
            std::upper_bound(from, like->end(), distance + slack,
                             [](double d, const MapIndex::Pair& p) { return d < p.distance; });
        if (from != to) all.push_back({a, b, from, to});
      }
    }
    std::stable_sort(all.begin(), all.end(), [](const SeenPair& a, const SeenPair& b) {
      return a.to - a.from < b.to - b.from;
    });
    std::size_t votes = 0;
    for (const SeenPair& pair : all) {
      if (votes > kMostVotes) return;
      const PlacedObject &a = seen_[pair.a], &b = seen_[pair.b];
      const Eigen::Vector2d between = (b.p - a.p).head<2>();
      const double bearing = std::atan2(between.y(), between.x());
      for (auto it = pair.from; it != pair.to; ++it, ++votes) {
        const PlacedObject &c = map_[it->c], &d = map_[it->d];
        const Eigen::Vector2d on_map = (d.p - c.p).head<2>();
        LevelPose x;
        x.yaw = wrapAngle(std::atan2(on_map.y(), on_map.x()) - bearing);
        if (!yawsAgree(a, c, x.yaw) || !yawsAgree(b, d, x.yaw)) continue;
        x.p = 0.5 * (c.p + d.p) - x.R() * (0.5 * (a.p + b.p));
        vote(cells, x, 1.0);
      }
    }
  }

  /// Adds votes by single objects, if the prior has an accurate yaw.
  void voteSingles(Cells& cells) const {
    if (prior_.covariance(3, 3) > kCell_rad * kCell_rad) return;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      for (std::size_t k = 0; k < map_.size(); ++k) {
        if (mostProbable(seen_[i]) != mostProbable(map_[k])) continue;
        if (!yawsAgree(seen_[i], map_[k], prior_.mean.yaw)) continue;
        LevelPose x = prior_.mean;
        x.p = map_[k].p - x.R() * seen_[i].p;
        vote(cells, x, 1.0);
      }
    }
  }

  std::vector<LevelPose> proposals() const {
    Cells cells;
    votePairs(cells);
    voteSingles(cells);
    std::vector<std::pair<std::uint64_t, Cell>> most(cells.begin(), cells.end());
    const auto more = [](const auto& a, const auto& b) {
      return a.second.votes > b.second.votes ||
             (a.second.votes == b.second.votes && a.first < b.first);
    };
    const std::size_t count = std::min(kMostCells, most.size());
    std::partial_sort(most.begin(), most.begin() + static_cast<std::ptrdiff_t>(count), most.end(),
                      more);
    most.resize(count);
    std::vector<LevelPose> result;
    if (deviations2(prior_.mean) == 0.0 && !map_.empty()) result.push_back(prior_.mean);
    for (const auto& [key, cell] : most) {
      LevelPose x;
      x.yaw = std::atan2(cell.heading.y(), cell.heading.x());
      x.p << cell.place / cell.votes, prior_.mean.p.z();
      // Votes for one pose are spread over adjacent cells.
      const bool another = std::all_of(result.begin(), result.end(), [&](const LevelPose& chosen) {
        return (chosen.p - x.p).head<2>().norm() > kCell_m ||
               std::abs(wrapAngle(chosen.yaw - x.yaw)) > kCell_rad;
      });
      if (!another) continue;
      x.p.z() = height(x);
      result.push_back(x);
      if (result.size() == kCandidates) break;
    }
    return result;
  }

  /// Returns the z of the body at which the heights of observed objects best match those of nearby
  /// map objects of their class.
  double height(const LevelPose& x) const {
    std::vector<double> heights;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const Eigen::Vector3d arm = x.R() * seen_[i].p;
      const Eigen::Vector2d at = (x.p + arm).head<2>();
      index_.around(at, [&](std::size_t k) {
        if (mostProbable(seen_[i]) != mostProbable(map_[k])) return;
        if ((at - map_[k].p.head<2>()).norm() < kCell_m + 1.0) {
          heights.push_back(map_[k].p.z() - arm.z());
        }
      });
    }
    if (heights.empty()) return x.p.z();
    const auto half = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
    std::nth_element(heights.begin(), half, heights.end());
    return *half;
  }

  struct Likelihood {
    double of_map = 0.0;     ///< density if the object is on the map
    double by_chance = 0.0;  ///< density of an unrelated object at that place
    std::size_t object = 0;  ///< index of the most probable map object
    double of_object = 0.0;
    double known = 0.0;  ///< probability that an object at that place is on the map
  };

  /// Densities of the position of observed object i, m⁻².
  Likelihood likelihoodOf(std::size_t i, const LevelPose& x, const Eigen::Matrix3d& R,
                          double blur) const {
    const PlacedObject& seen = seen_[i];
    const Eigen::Vector3d at = x.p + R * seen.p;
    const Eigen::Matrix2d turned = R.topLeftCorner<2, 2>() * seen.covariance.topLeftCorner<2, 2>() *
                                   R.topLeftCorner<2, 2>().transpose();
    Likelihood l;
    index_.around(at.head<2>(), [&](std::size_t k) {
      const PlacedObject& known = map_[k];
      const Eigen::Vector2d off = (at - known.p).head<2>();
      const double squared = off.squaredNorm();
      if (squared > kReach_m * kReach_m) return;
      l.by_chance +=
          std::exp(-0.5 * squared / (kStreet_m * kStreet_m)) / (2.0 * kPi * kStreet_m * kStreet_m);
      Eigen::Matrix2d S = known.covariance.topLeftCorner<2, 2>() + turned;
      S.diagonal().array() += blur * blur + kRepeat_m * kRepeat_m;
      const double determinant = S.determinant();
      const double mahalanobis = (S(1, 1) * off.x() * off.x() - 2.0 * S(0, 1) * off.x() * off.y() +
                                  S(0, 0) * off.y() * off.y()) /
                                 determinant;
      if (mahalanobis > 25.0) return;
      const double density =
          sameClass(i, k) *
          std::exp(-0.5 * mahalanobis + logSameYaw(known.yaw - seen.yaw - x.yaw,
                                                   seen.covariance(3, 3) + known.covariance(3, 3) +
                                                       kRepeat_rad * kRepeat_rad)) /
          (2.0 * kPi * std::sqrt(determinant));
      l.of_map += density;
      if (density > l.of_object) {
        l.of_object = density;
        l.object = k;
      }
    });
    l.known = index_.knownShare(at.head<2>());
    return l;
  }

  /// Returns the most probable map object for an observed one, and its probability.
  std::pair<std::size_t, double> matchOf(std::size_t i, const LevelPose& x,
                                         const Eigen::Matrix3d& R, double blur) const {
    const Likelihood l = likelihoodOf(i, x, R, blur);
    const double all = (1.0 - l.known) * (l.by_chance + kFloor) + l.known * l.of_map;
    return {l.object, l.known * l.of_object / all};
  }

  /// Returns the indices of map objects, each with that of the observed object that certainly
  /// matches. If two observed objects match one map object, neither forms a pair, because they may
  /// be neighbours.
  std::map<std::size_t, std::size_t> surePairs(const LevelPose& x) const {
    const Eigen::Matrix3d R = x.R();
    std::map<std::size_t, std::size_t> pairs;
    std::set<std::size_t> twice;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const auto [k, share] = matchOf(i, x, R, 0.0);
      if (share >= kSure && !pairs.emplace(k, i).second) twice.insert(k);
    }
    for (const std::size_t k : twice) pairs.erase(k);
    return pairs;
  }

  double scoreOf(const LevelPose& x) const {
    const Eigen::Matrix3d R = x.R();
    double sum = -0.5 * deviations2(x);
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const Likelihood l = likelihoodOf(i, x, R, 0.0);
      sum += group_shares_[i] * std::log1p(-l.known + l.known * l.of_map / (l.by_chance + kFloor));
    }
    return sum;
  }

  /// The score of the hypothesis that no observed object is on the map: the best of five poses
  /// inside the prior.
  double scoreOfNone() const {
    const double reach = 2.0 * std::sqrt(prior_.covariance.topLeftCorner<2, 2>().trace());
    double best = -1e9;
    for (const Eigen::Vector2d& way :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0),
          Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
      LevelPose x = prior_.mean;
      x.p.head<2>() += reach * way;
      const Eigen::Matrix3d R = x.R();
      double sum = 0.0;
      for (std::size_t i = 0; i < seen_.size(); ++i) {
        const double known = index_.knownShare((x.p + R * seen_[i].p).head<2>());
        sum += group_shares_[i] * std::log1p(-known);
      }
      best = std::max(best, sum);
    }
    return best;
  }

  LevelPose settled(LevelPose x) const {
    for (const double blur : {1.5, 1.0, 0.5, 0.2, 0.0, 0.0}) {
      MatchEquations equations;
      equations.information = prior_information_;
      equations.pull = prior_information_ * difference(prior_.mean, x);
      const Eigen::Matrix3d R = x.R();
      for (std::size_t i = 0; i < seen_.size(); ++i) {
        const auto [k, share] = matchOf(i, x, R, blur);
        if (share < 0.1) continue;
        equations.add(seen_[i], map_[k], x, share, blur);
      }
      if (equations.weights == 0.0) break;
      const Eigen::Vector4d step = equations.step();
      x.p += step.head<3>();
      x.yaw = wrapAngle(x.yaw + step[3]);
    }
    return x;
  }

  PlaceParameters parameters_;
  LevelGaussian prior_;
  std::vector<PlacedObject> seen_;
  std::vector<double> group_shares_;
  const MapIndex& index_;
  const std::vector<PlacedObject>& map_;
  Eigen::Matrix4d prior_information_;
  std::vector<std::vector<double>> class_weights_;
};

}  // namespace

std::optional<PlaceMatch> bestMatch(std::vector<PlacedObject> seen, const MapIndex& map,
                                    const LevelGaussian& prior, const PlaceParameters& parameters) {
  if (seen.empty() || map.objects().empty()) return std::nullopt;
  return Search(std::move(seen), map, prior, parameters).best();
}

}  // namespace perdure::mapping
