#include "tools/calibrate/motion/first_guess.h"

#include <Eigen/SVD>
#include <cmath>

#include "tools/data_check/image_turn.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::calibrate {
namespace {

/// Two images of a window.
struct Pair {
  TimePoint from, to;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> pixels;
};

std::vector<Pair> pairsOf(const std::vector<TrackWindow>& windows) {
  constexpr std::size_t kMost = 200, kFewest = 15;
  std::vector<Pair> all;
  for (const TrackWindow& window : windows) {
    for (std::size_t i = 1; i < window.times.size(); ++i) {
      Pair pair{window.times[i - 1], window.times[i], {}};
      for (const Track& track : window.tracks) {
        if (track.size() > i) pair.pixels.emplace_back(track[i - 1], track[i]);
      }
      if (pair.pixels.size() >= kFewest) all.push_back(std::move(pair));
    }
  }
  const std::size_t each = all.size() / kMost + 1;
  std::vector<Pair> some;
  for (std::size_t i = 0; i < all.size(); i += each) some.push_back(std::move(all[i]));
  return some;
}

Eigen::Vector3d turnOf(const Pair& pair, double focal, const CameraCalibration& camera) {
  const Eigen::Vector2d centre(0.5 * (camera.width - 1.0), 0.5 * (camera.height - 1.0));
  const auto rayOf = [&](const Eigen::Vector2d& pixel) {
    return Eigen::Vector3d(((pixel - centre) / focal).homogeneous().normalized());
  };
  std::vector<tools::Flow> flow;
  for (const auto& [a, b] : pair.pixels) flow.push_back({rayOf(a), rayOf(b) - rayOf(a)});
  return tools::rotationOf(flow);
}

/// The gyroscope's rotations of all pairs at one offset, and which pairs it covers.
struct Said {
  double offset_s = 0.0;
  std::vector<std::size_t> pairs;
  std::vector<Eigen::Vector3d> turns;
};

std::vector<Said> saidAt(const std::vector<Pair>& pairs, const std::vector<ImuSample>& samples) {
  constexpr int kSteps = 100;
  constexpr double kStep_s = 0.005;
  const tools::TurnIntegral gyro(samples);
  std::vector<Said> all;
  for (int step = -kSteps; step <= kSteps; ++step) {
    Said said{kStep_s * step, {}, {}};
    const Duration later = durationFromSeconds(said.offset_s);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!gyro.covers(pairs[i].from + later, pairs[i].to + later)) continue;
      said.pairs.push_back(i);
      said.turns.push_back(gyro.between(pairs[i].from + later, pairs[i].to + later));
    }
    if (2 * said.pairs.size() > pairs.size()) all.push_back(std::move(said));
  }
  return all;
}

}  // namespace

FirstGuess guessFromTurns(const std::vector<TrackWindow>& windows,
                          const std::vector<ImuSample>& samples, const CameraCalibration& camera) {
  constexpr double kLeast = 0.4, kMost = 2.5, kRatio = 1.15;  // focal lengths, in widths
  FirstGuess best;
  best.camera = camera;
  const auto pairs = pairsOf(windows);
  const auto said = saidAt(pairs, samples);
  for (double focal = kLeast; focal < kMost; focal *= kRatio) {
    std::vector<Eigen::Vector3d> turns;
    for (const Pair& pair : pairs) turns.push_back(turnOf(pair, focal * camera.width, camera));
    for (const Said& one : said) {
      std::vector<Eigen::Vector3d> seen;
      for (const std::size_t i : one.pairs) seen.push_back(turns[i]);
      const tools::TurnPairs both(seen, one.turns);
      const Eigen::Matrix3d R_CB = both.bestRotation();
      const double unexplained = both.disagreementBy(R_CB);
      if (unexplained >= best.unexplained) continue;
      best.unexplained = unexplained;
      best.pairs = both.count();
      best.camera.fx = best.camera.fy = focal * camera.width;
      best.camera.T_BC.q = Eigen::Quaterniond(Eigen::Matrix3d(R_CB.transpose()));
      best.camera.time_offset_s = one.offset_s;
      const Eigen::Vector3d spread =
          Eigen::JacobiSVD<Eigen::Matrix3Xd>(both.given).singularValues() /
          std::sqrt(static_cast<double>(both.count()));
      best.turning_px = spread.norm() * best.camera.fx;
      best.second_px = spread[1] * best.camera.fx;
    }
  }
  return best;
}

}  // namespace perdure::calibrate
