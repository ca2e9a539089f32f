#include "services/vio/core/state/saved_state.h"

#include <charconv>
#include <cmath>
#include <sstream>

namespace perdure::vio {
namespace {

constexpr const char* kMagic = "perdure-vio-state-4";
// Standard deviations of a vehicle's unobserved turn rate (rad/s) and acceleration (m/s²).
constexpr double kTurnRate = 0.3, kAcceleration = 1.5;
// Factor on the covariance, because its correlations with the window are lost.
constexpr double kInflation = 1.5;

/// Calls `each` for every number of the state, in the order of the text. The sizes of vectors and
/// matrices must be set.
template <class State, class Each>
void forNumbers(State& s, Each each) {
  const auto all = [&](auto&& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      for (Eigen::Index r = 0; r < m.rows(); ++r) each(m(r, c));
    }
  };
  all(s.nav.q_WB.coeffs());
  for (auto* v : {&s.nav.p_WB, &s.nav.v_WB, &s.nav.gyro_bias, &s.nav.accel_bias}) all(*v);
  for (auto& T : s.T_BC) all(T.q.coeffs()), all(T.p);
  each(s.time_offset_s);
  for (auto& readout : s.readout_s) each(readout);
  for (auto& lens : s.lens) all(lens);
  all(s.gyro_scale);
  all(s.covariance);
}

}  // namespace

std::string toText(const SavedState& s) {
  std::string body = std::to_string(s.world.world) + ' ' + std::to_string(s.world.epoch) + ' ' +
                     std::to_string(toNanoseconds(s.time)) + ' ' + std::to_string(s.next_track) +
                     ' ' + std::to_string(s.T_BC.size()) + ' ' +
                     std::to_string(s.estimated.readout) + ' ' + std::to_string(s.estimated.scale) +
                     ' ' + std::to_string(s.estimated.lens) + ' ' +
                     std::to_string(s.covariance.rows()) + '\n';
  forNumbers(s, [&](double value) {
    char buffer[40];
    body.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr) += ' ';
  });
  return std::string(kMagic) + ' ' + toHex(digest(body)) + '\n' + body;
}

Result<SavedState> fromText(const std::string& text) {
  const auto malformed = [](const char* why) { return fail("state_malformed", why); };
  const std::size_t line = text.find('\n');
  if (line == std::string::npos) return malformed("it is cut off");
  const std::string body = text.substr(line + 1);
  if (text.substr(0, line) != std::string(kMagic) + ' ' + toHex(digest(body))) {
    return malformed("its check sum or version does not fit");
  }
  std::istringstream in(body);
  SavedState s;
  std::int64_t time = 0;
  std::size_t cameras = 0;
  Eigen::Index n = 0;
  in >> s.world.world >> s.world.epoch >> time >> s.next_track >> cameras;
  in >> s.estimated.readout >> s.estimated.scale >> s.estimated.lens >> n;
  if (!in || cameras < 1 || cameras > 2) return malformed("its head");
  const Eigen::Index least = kNavSize + 6 * static_cast<Eigen::Index>(cameras) + 1;
  const Eigen::Index most =
      least + (1 + kLensSize) * static_cast<Eigen::Index>(cameras) + kScaleSize;
  if (n < least || n > most) return malformed("its head");
  s.time = fromNanoseconds(time);
  s.T_BC.resize(cameras);
  s.readout_s.resize(cameras);
  s.lens.resize(cameras);
  s.covariance.resize(n, n);
  bool good = true;
  forNumbers(s, [&](double& value) {
    std::string word;
    in >> word;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    good = good && error == std::errc() && stop == end && std::isfinite(value);
  });
  good = good && n == calibrationSize(s.readout_s, s.estimated);
  const auto isUnit = [](const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1.0) < 1e-6; };
  good = good && isUnit(s.nav.q_WB);
  for (RigidTransform& T : s.T_BC) good = good && isUnit(T.q), T.q.normalize();
  if (!good) return malformed("a number");
  return s;
}

void coast(SavedState& s, double gap_s) {
  const double gap = std::max(gap_s, 0.0);
  s.time += durationFromSeconds(gap);
  s.nav.p_WB += gap * s.nav.v_WB;
  // The error of v adds to that of p; rows and columns give the correlations too.
  s.covariance.middleRows(kPosition, 3) += gap * s.covariance.middleRows(kVelocity, 3).eval();
  s.covariance.middleCols(kPosition, 3) += gap * s.covariance.middleCols(kVelocity, 3).eval();
  s.covariance *= kInflation;
  const double turn = kTurnRate * gap, speed = kAcceleration * gap, way = 0.5 * speed * gap;
  const double drift = turn * s.nav.v_WB.norm();  // the velocity turns with the body
  s.covariance.diagonal().segment<3>(kTheta).array() += turn * turn;
  s.covariance.diagonal().segment<3>(kVelocity).array() += speed * speed + drift * drift;
  s.covariance.diagonal().segment<3>(kPosition).array() +=
      way * way + 0.25 * drift * drift * gap * gap;
}

}  // namespace perdure::vio
