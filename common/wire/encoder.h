// Encodes domain types into wire types and checks every field. Internal to common/wire.
#pragma once

#include <algorithm>

#include "common/wire/arena.h"
#include "common/wire/checked.h"

namespace perdure::wire {

class Encoder : public Checked {
 public:
  explicit Encoder(Arena& arena) : arena_(arena) {}

  template <class X>
  void value(const char*, const X& d, X& w) {
    w = d;
  }
  void time(const char* name, const TimePoint& d, std::int64_t& w) {
    w = toNanoseconds(d);
    checkTime(name, w);
  }
  void number(const char* name, const double& d, double& w, const Limits& limits) {
    checkNumber(name, d, limits);
    w = d;
  }
  /// Values slightly outside [0, 1] due to rounding are sent as 0 or 1.
  void probability(const char* name, const double& d, double& w) {
    constexpr double kRounding = 1e-9;
    checkNumber(name, d, {kProbability.low - kRounding, kProbability.high + kRounding});
    w = std::clamp(d, kProbability.low, kProbability.high);
  }
  template <class E>
  void choice(const char* name, const E& d, std::uint8_t& w, E last) {
    if (d > last) refuse(name, "bad_enum");
    w = static_cast<std::uint8_t>(d);
  }
  void text(const char* name, const std::string& d, char*& w, std::size_t longest) {
    checkText(name, d, longest);
    w = const_cast<char*>(d.c_str());  // Cyclone's C types lack const; the text is only read
  }
  void name(const char* field, const std::string& d, char*& w) {
    if (d.empty()) refuse(field, "empty");
    text(field, d, w, kNameLength);
  }
  template <class M, std::size_t N>
  void matrix(const char* name, const M& d, double (&w)[N], const Limits& limits) {
    static_assert(M::SizeAtCompileTime == static_cast<int>(N));
    checkMatrix(name, d, limits);
    copyRows(d, w);
  }
  template <class M, std::size_t N>
  void symmetric(const char* name, const M& d, double (&w)[N]) {
    checkSymmetric(name, d);
    copyTriangle(d, w);
  }
  template <class M, std::size_t N>
  void covariance(const char* name, const M& d, double (&w)[N]) {
    checkCovariance(name, d);
    copyTriangle(d, w);
  }
  void unit(const char* name, const Eigen::Vector3d& d, double (&w)[3]) {
    checkUnit(name, d.norm());
    copyRows(d, w);
  }
  void pose(const char* name, const RigidTransform& d, perdure_msg_Pose& w) {
    checkUnit(name, d.q.norm());
    checkMatrix(name, d.p, kCoordinate);
    copyRows(d.q.coeffs(), w.q);
    copyRows(d.p, w.p);
  }
  template <class D, class W>
  void object(const char* name, const D& d, W& w) {
    under(name, -1, [&] { describe(*this, d, w); });
  }
  template <class D, class W>
  void optional(const char* name, const std::optional<D>& d, bool& has, W& w) {
    has = d.has_value();
    if (has) object(name, *d, w);
  }
  void optionalNumber(const char* name, const std::optional<double>& d, bool& has, double& w,
                      const Limits& limits) {
    has = d.has_value();
    if (has) number(name, *d, w, limits);
  }
  template <class D, class S>
  void list(const char* name, const std::vector<D>& d, S& w, std::size_t most) {
    if (!checkCount(name, d.size(), most)) return;
    reserve(w, d.size());
    for (std::size_t i = 0; i < d.size() && !failed(); ++i) {
      under(name, static_cast<long>(i), [&] { describe(*this, d[i], w._buffer[i]); });
    }
  }
  template <class X, class S>
  void numbers(const char* name, const std::vector<X>& d, S& w, const Limits& limits,
               std::size_t most) {
    if (!checkCount(name, d.size(), most)) return;
    reserve(w, d.size());
    for (std::size_t i = 0; i < d.size(); ++i) {
      if (!checkNumber(name, static_cast<double>(d[i]), limits)) return;
      w._buffer[i] = d[i];
    }
  }
  template <class S>
  void names(const char* field, const std::vector<std::string>& d, S& w, std::size_t most) {
    if (!checkCount(field, d.size(), most)) return;
    reserve(w, d.size());
    for (std::size_t i = 0; i < d.size(); ++i) name(field, d[i], w._buffer[i]);
  }
  template <class Counts, class S>
  void counts(const char* field, const Counts& d, S& w, std::size_t most) {
    if (!checkCount(field, d.size(), most)) return;
    reserve(w, d.size());
    std::size_t i = 0;
    for (const auto& [reason, count] : d) {
      name(field, reason, w._buffer[i].reason);
      w._buffer[i++].count = count;
    }
  }
  template <std::size_t N>
  void bytes(const char*, const std::array<std::uint8_t, N>& d, std::uint8_t (&w)[N]) {
    std::copy(d.begin(), d.end(), w);
  }
  void pixels(const char* name, const Frame& d, perdure_msg_Frame& w) {
    if (!d.data || !isSizeOf(d, d.data->size())) return refuse(name, "size_mismatch");
    if (!checkCount(name, d.data->size(), kImageBytes)) return;
    w.pixels._buffer = const_cast<std::uint8_t*>(d.data->data());  // the data are not modified
    w.pixels._length = w.pixels._maximum = static_cast<std::uint32_t>(d.data->size());
    w.pixels._release = false;
  }
  template <class Predicate>
  void ensureWire(const char*, const char*, Predicate) {}

 private:
  template <class S>
  void reserve(S& w, std::size_t count) {
    w._buffer = arena_.allocate<std::remove_pointer_t<decltype(w._buffer)>>(count);
    w._length = w._maximum = static_cast<std::uint32_t>(count);
    w._release = false;
  }
  template <class M>
  static void copyRows(const M& d, double* w) {
    for (Eigen::Index r = 0; r < d.rows(); ++r) {
      for (Eigen::Index c = 0; c < d.cols(); ++c) *w++ = d(r, c);
    }
  }
  template <class M, std::size_t N>
  static void copyTriangle(const M& d, double (&w)[N]) {
    constexpr int n = M::RowsAtCompileTime;
    static_assert(N == n * (n + 1) / 2);
    double* next = w;
    for (int r = 0; r < n; ++r) {
      for (int c = r; c < n; ++c) *next++ = d(r, c);
    }
  }

  Arena& arena_;
};

}  // namespace perdure::wire
