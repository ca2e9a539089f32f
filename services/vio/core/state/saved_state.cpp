#include "services/vio/core/state/saved_state.h"

#include <charconv>
#include <cmath>
#include <sstream>

namespace perdure::vio {
namespace {

constexpr const char* kMagic = "perdure-vio-state-3";
// Assumed unobserved turn rate and acceleration of a vehicle.
constexpr double kTurnRate = 0.3, kAcceleration = 1.5;
// Factor for the lost correlations with the window.
constexpr double kInflation = 1.5;

void put(std::string& out, double value) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  out.append(buffer, end);
  out += ' ';
}

template <class Derived>
void put(std::string& out, const Eigen::MatrixBase<Derived>& m) {
  for (Eigen::Index c = 0; c < m.cols(); ++c) {
    for (Eigen::Index r = 0; r < m.rows(); ++r) put(out, m(r, c));
  }
}

class Reader {
 public:
  explicit Reader(const std::string& text) : in_(text) {}
  template <class T>
  T integer() {
    T value{};
    if (!(in_ >> value)) good_ = false;
    return value;
  }
  double number() {
    std::string word;
    double value = 0.0;
    if (!(in_ >> word)) {
      good_ = false;
      return 0.0;
    }
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      good_ = false;
    }
    return value;
  }
  Eigen::Vector3d vector() {
    Eigen::Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = number();
    return v;
  }
  Eigen::Quaterniond rotation() {
    Eigen::Vector4d v;
    for (int i = 0; i < 4; ++i) v[i] = number();
    if (!(std::abs(v.norm() - 1.0) < 1e-6)) good_ = false;
    return Eigen::Quaterniond(v[3], v[0], v[1], v[2]);
  }
  bool good() const { return good_; }
  void bad() { good_ = false; }

 private:
  std::istringstream in_;
  bool good_ = true;
};

}  // namespace

std::string toText(const SavedState& s) {
  std::string body = std::to_string(s.world.world) + ' ' + std::to_string(s.world.epoch) + ' ' +
                     std::to_string(toNanoseconds(s.time)) + ' ' + std::to_string(s.next_track) +
                     ' ' + std::to_string(s.T_BC.size()) + ' ' +
                     std::to_string(s.covariance.rows()) + '\n';
  put(body, s.nav.q_WB.coeffs());
  for (const auto* v : {&s.nav.p_WB, &s.nav.v_WB, &s.nav.gyro_bias, &s.nav.accel_bias}) {
    put(body, *v);
  }
  for (const RigidTransform& T : s.T_BC) {
    put(body, T.q.coeffs());
    put(body, T.p);
  }
  put(body, s.time_offset_s);
  for (const double readout : s.readout_s) put(body, readout);
  put(body, s.gyro_scale);
  put(body, s.covariance);
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
  Reader in(body);
  SavedState s;
  s.world.world = in.integer<std::uint64_t>();
  s.world.epoch = in.integer<std::uint32_t>();
  s.time = fromNanoseconds(in.integer<std::int64_t>());
  s.next_track = in.integer<std::uint64_t>();
  const auto cameras = in.integer<std::size_t>();
  const auto n = in.integer<Eigen::Index>();
  if (!in.good() || cameras < 1 || cameras > 2) return malformed("its head");
  const Eigen::Index least = kNavSize + 6 * static_cast<Eigen::Index>(cameras) + 1;
  if (n < least || n > least + static_cast<Eigen::Index>(cameras) + kScaleSize) {
    return malformed("its head");
  }
  s.nav.q_WB = in.rotation();
  for (auto* v : {&s.nav.p_WB, &s.nav.v_WB, &s.nav.gyro_bias, &s.nav.accel_bias}) {
    *v = in.vector();
  }
  for (std::size_t i = 0; i < cameras; ++i) {
    const Eigen::Quaterniond q = in.rotation();
    s.T_BC.emplace_back(q, in.vector());
  }
  s.time_offset_s = in.number();
  for (std::size_t i = 0; i < cameras; ++i) s.readout_s.push_back(in.number());
  s.gyro_scale = in.vector();
  s.covariance.resize(n, n);
  for (Eigen::Index c = 0; c < n; ++c) {
    for (Eigen::Index r = 0; r < n; ++r) s.covariance(r, c) = in.number();
  }
  if (!in.good()) return malformed("a number");
  return s;
}

void coast(SavedState& s, double gap_s) {
  const double gap = std::max(gap_s, 0.0);
  s.time += durationFromSeconds(gap);
  s.nav.p_WB += gap * s.nav.v_WB;
  // The error in v adds to the error in p, and correlations follow.
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
