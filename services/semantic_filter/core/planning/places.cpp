#include "services/semantic_filter/core/planning/places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "common/camera/ground_view.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kReach = 10.0;  // cells; farther ground is seen at a grazing angle
constexpr int kWindow = 3;       // cells; radius of the window of the local density

using Key = std::pair<int, int>;

struct Cell {
  bool seen = false, planned = false;
  double objects = 0.0;  ///< expected number of known objects
  double ground_m = 0.0;
  Directions seen_from = Directions::Zero();  ///< of known objects in it
};

/// The cells of the ground around the poses, and the objects that stand there.
class Ground {
 public:
  Ground(const std::vector<Candidate>& known, const Observer& observer)
      : observer_(observer), prior_(mostFrequentClass(known, *observer.priors)) {
    cell_m_ = std::exp(prior_.log_size[0]);
    for (const Candidate& c : known) {
      const State& x = c.track.best().x;
      Cell& cell = cells_[keyOf(x)];
      cell.objects += c.track.existence;
      cell.seen_from = cell.seen_from.cwiseMax(c.track.detectability.seen_from);
    }
  }

  /// Marks the cells that a view shows. `height_m`: of the body's origin above the ground.
  void mark(const TimedView& view, double height_m, bool Cell::*what) {
    const double ground_m = view.T_WB.p.z() - height_m;
    const GroundGrid grid{cell_m_, kReach * cell_m_, placeOf({}, ground_m).z()};
    forGroundInView(*observer_.camera, view.T_WB, grid, [&](int i, int j) {
      Cell& cell = cells_[{i, j}];
      cell.*what = true;
      cell.ground_m = ground_m;
    });
  }

  /// Returns the planned cells without a known object, as they were `since`.
  std::vector<Candidate> places(TimePoint since) const {
    const Density density = densityOfAll();
    std::vector<Candidate> places;
    for (const auto& [key, cell] : cells_) {
      if (!cell.planned || cell.objects >= 0.5) continue;
      places.push_back(placeAt(key, cell, density, since));
    }
    return places;
  }

 private:
  /// Objects per cell: a gamma distribution over all windows.
  struct Density {
    double mean = 0.0;   ///< objects per cell
    double shape = 0.0;  ///< of the gamma distribution; infinite: the density is the same anywhere
  };
  struct Window {
    double objects = 0.0, seen_cells = 0.0;
    Directions seen_from = Directions::Zero();  ///< of objects in adjacent cells
  };

  static const ClassPrior& mostFrequentClass(const std::vector<Candidate>& known,
                                             const ClassPriors& priors) {
    std::map<std::string, double> count;
    for (const Candidate& c : known) count[c.track.best().class_name] += c.track.existence;
    const auto most = std::max_element(count.begin(), count.end(),
                                       [](auto& a, auto& b) { return a.second < b.second; });
    return priors.of(most->first);
  }

  template <class Place>
  Key keyOf(const Place& place) const {
    return {static_cast<int>(std::floor(place[0] / cell_m_)),
            static_cast<int>(std::floor(place[1] / cell_m_))};
  }
  /// Returns the centre of an object of the usual height in the cell.
  Eigen::Vector3d placeOf(const Key& key, double ground_m) const {
    return {(key.first + 0.5) * cell_m_, (key.second + 0.5) * cell_m_,
            ground_m + 0.5 * std::exp(prior_.log_size[2])};
  }

  Window windowAt(const Key& at) const {
    Window window;
    for (int i = -kWindow; i <= kWindow; ++i) {
      for (int j = -kWindow; j <= kWindow; ++j) {
        if (i * i + j * j > kWindow * kWindow) continue;
        const auto found = cells_.find({at.first + i, at.second + j});
        if (found == cells_.end()) continue;
        const Cell& cell = found->second;
        window.objects += cell.objects;
        window.seen_cells += cell.seen || cell.objects > 0.0 ? 1.0 : 0.0;
        if (std::abs(i) <= 1 && std::abs(j) <= 1) {
          window.seen_from = window.seen_from.cwiseMax(cell.seen_from);
        }
      }
    }
    return window;
  }

  Density densityOfAll() const {
    double objects = 0.0, seen = 0.0, square = 0.0, excess = 0.0;
    std::vector<Window> windows;
    for (const auto& [key, cell] : cells_) {
      if (!cell.seen && cell.objects <= 0.0) continue;
      objects += cell.objects, seen += 1.0;
      windows.push_back(windowAt(key));
    }
    Density density{objects / std::max(seen, 1.0), std::numeric_limits<double>::infinity()};
    for (const Window& w : windows) {
      const double mean = density.mean * w.seen_cells;
      square += mean * mean;
      excess += (w.objects - mean) * (w.objects - mean) - mean;
    }
    if (excess > 0.0) density.shape = square / excess;
    return density;
  }

  Candidate placeAt(const Key& key, const Cell& cell, const Density& density,
                    TimePoint since) const {
    constexpr double kMost = 0.5;  // the density is that of separate objects
    const Window window = windowAt(key);
    Candidate place;
    place.stationary = density.mean;
    if (std::isfinite(density.shape)) {
      place.stationary =
          (window.objects + density.shape) / (window.seen_cells + density.shape / density.mean);
    }
    place.stationary = std::min(place.stationary, kMost);
    Track& track = place.track;
    track.existence = {place.stationary, ExistenceEvidence::kPrior, since};
    track.as_of = since;
    track.detectability.seen_from = window.seen_from;
    Hypothesis h;
    h.class_name = prior_.name;
    h.weight = 1.0;
    h.x.head<3>() = placeOf(key, cell.ground_m);
    h.x.segment<3>(kSize) = prior_.log_size;
    h.P.setZero();
    h.P.diagonal().head<4>().setConstant(cell_m_ * cell_m_ / 12.0);
    h.P.block<3, 3>(kSize, kSize) = prior_.log_size_covariance;
    track.hypotheses.push_back(h);
    return place;
  }

  const Observer& observer_;
  const ClassPrior& prior_;
  double cell_m_;
  std::map<Key, Cell> cells_;
};

/// Returns the height of the body's origin above the undersides of the objects, the median.
double heightAboveGround(const std::vector<Candidate>& known, const std::vector<TimedView>& past) {
  std::vector<double> heights;
  for (const Candidate& c : known) {
    const State& x = c.track.best().x;
    const auto distance = [&](const TimedView& v) { return (v.T_WB.p - x.head<3>()).norm(); };
    const auto nearest = std::min_element(
        past.begin(), past.end(), [&](auto& a, auto& b) { return distance(a) < distance(b); });
    heights.push_back(nearest->T_WB.p.z() - (x[2] - 0.5 * std::exp(x[kSize + 2])));
  }
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

}  // namespace

void addPlaces(std::vector<Candidate>& candidates, const std::vector<TimedView>& past,
               const std::vector<TimedView>& planned, const Observer& observer) {
  if (candidates.empty() || past.empty()) return;
  const double height_m = heightAboveGround(candidates, past);
  Ground ground(candidates, observer);
  for (const TimedView& view : past) ground.mark(view, height_m, &Cell::seen);
  for (const TimedView& view : planned) ground.mark(view, height_m, &Cell::planned);
  for (Candidate& place : ground.places(past.front().time)) candidates.push_back(std::move(place));
  for (const TimedView& view : past) observeNothing(candidates, view, observer);
}

}  // namespace perdure::semantic_filter
