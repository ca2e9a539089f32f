#include "tools/data_check/samples/mean_force.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

constexpr double kGravity_m_s2 = 9.81;

/// The mean force of a stretch, in B at the first sample, and in B of the stretch.
struct MeanForce {
  TimePoint from, to;
  Eigen::Vector3d fixed = Eigen::Vector3d::Zero(), of_body = fixed;
};
using MeanForces = std::vector<MeanForce>;

/// Stretches of the same length without gaps.
MeanForces meanForcesOf(const std::vector<ImuSample>& samples, Duration length) {
  const TurnIntegral gyro(samples);
  MeanForces all;
  for (std::size_t i = 0; i < samples.size();) {
    MeanForce one{samples[i].time, samples[i].time + length};
    double count = 0.0;
    for (; i < samples.size() && samples[i].time < one.to; ++i, ++count) {
      one.fixed += gyro.at(samples[i].time) * samples[i].accel;
      one.of_body += samples[i].accel;
    }
    if (i == samples.size() || !gyro.covers(one.from, samples[i].time)) continue;
    one.fixed /= count, one.of_body /= count;
    all.push_back(one);
  }
  return all;
}

struct Sizes {
  double least = 1e9, most = 0.0;
  double middle() const { return 0.5 * (least + most); }
};

Sizes sizesOf(MeanForces::const_iterator first, MeanForces::const_iterator last) {
  Sizes sizes;
  for (; first != last; ++first) {
    sizes.least = std::min(sizes.least, first->fixed.norm());
    sizes.most = std::max(sizes.most, first->fixed.norm());
  }
  return sizes;
}

/// The axis of the body along which most of the force acts.
char axisOf(const MeanForces& forces) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const MeanForce& one : forces) sum += one.of_body.cwiseAbs();
  Eigen::Index axis = 0;
  sum.maxCoeff(&axis);
  return "xyz"[axis];
}

replay::DataFindings judgeSize(const MeanForces& forces) {
  constexpr std::size_t kFewest = 3;
  constexpr double kLeast = 0.035, kMost = 0.2, kEqual = 0.35;  // last: share of the deviation
  const Sizes sizes = sizesOf(forces.begin(), forces.end());
  const double off = sizes.middle() - kGravity_m_s2;
  const bool sure = std::abs(off) > kLeast * kGravity_m_s2 &&
                    std::abs(off) < kMost * kGravity_m_s2 &&
                    sizes.most - sizes.least < kEqual * std::abs(off);
  if (forces.size() < kFewest || !sure) return {};
  return {{replay::DataFinding::Grade::kCause, "accel_factor",
           fmt::format("the mean force is {:.2f} to {:.2f} m/s² in all of {} stretches, where "
                       "gravity is 9.81: the accelerometer's scale along {}, which points up or "
                       "down, is {:.3f} times the right one, or it has a bias of {:.2f} m/s²; "
                       "calibrate the accelerometer, or divide by this factor",
                       sizes.least, sizes.most, forces.size(), axisOf(forces),
                       sizes.middle() / kGravity_m_s2, off)}};
}

double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The mean direction of some stretches, and the largest angle of one of them to it.
struct Direction {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double spread = 0.0;
};

Direction directionOf(MeanForces::const_iterator first, MeanForces::const_iterator last) {
  Direction direction;
  for (auto one = first; one != last; ++one) direction.mean += one->fixed.normalized();
  for (auto one = first; one != last; ++one) {
    direction.spread = std::max(direction.spread, angleBetween(one->fixed, direction.mean));
  }
  return direction;
}

/// The stretch in which direction or size of the force changes once and for all.
replay::DataFindings judgeForceChange(const MeanForces& forces) {
  constexpr double kTurned = 0.9, kOther_m_s2 = 0.6, kEqual = 0.35;
  for (std::size_t k = 2; k + 3 <= forces.size(); ++k) {  // the change is in stretch k
    const auto middle = forces.begin() + static_cast<std::ptrdiff_t>(k);
    const Sizes before = sizesOf(forces.begin(), middle), after = sizesOf(middle + 1, forces.end());
    const Direction d0 = directionOf(forces.begin(), middle),
                    d1 = directionOf(middle + 1, forces.end());
    const double angle = angleBetween(d0.mean, d1.mean);
    const bool turned =
        std::min(angle, angleBetween(forces[k - 1].fixed, forces[k + 1].fixed)) > kTurned &&
        std::min(d0.spread, d1.spread) < kEqual * angle;
    const double size = std::abs(after.middle() - before.middle());
    const double spread = std::max(before.most - before.least, after.most - after.least);
    const bool other = size > kOther_m_s2 && spread < kEqual * size;
    if (!turned && !other) continue;
    const std::string what =
        !turned ? fmt::format("from {:.2f} to {:.2f} m/s²", before.middle(), after.middle())
                : fmt::format("its direction by {:.0f}°, which the gyroscope does not show",
                              angle * 180.0 / M_PI);
    return {{replay::DataFinding::Grade::kCause, "accel_changes",
             fmt::format("the mean force changes {} between {} and {} ns: from there on, a sign, "
                         "the scale, the bias or the columns of the accelerometer are others, or "
                         "it came loose; cut the drive there",
                         what, toNanoseconds(forces[k].from), toNanoseconds(forces[k + 1].from))}};
  }
  return {};
}

}  // namespace

replay::DataFindings checkMeanForce(const std::vector<ImuSample>& samples) {
  constexpr Duration kSize = std::chrono::seconds(4), kChange = std::chrono::seconds(2);
  if (samples.size() < 2) return {};
  auto changes = judgeForceChange(meanForcesOf(samples, kChange));
  return changes.empty() ? judgeSize(meanForcesOf(samples, kSize)) : changes;
}

}  // namespace perdure::tools
