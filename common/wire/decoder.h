// Decodes wire types into domain types and checks every field. Internal to common/wire.
#pragma once

#include <cstring>

#include "common/wire/checked.h"

namespace perdure::wire {

class Decoder : public Checked {
 public:
  Decoder() = default;
  /// Pixels are not copied; `keeper` owns their memory.
  explicit Decoder(std::shared_ptr<const void> keeper) : keeper_(std::move(keeper)) {}

  template <class X>
  void value(const char*, X& d, const X& w) {
    d = w;
  }
  void value(const char* name, bool& d, const bool& w) { d = isTrue(name, w); }
  void time(const char* name, TimePoint& d, const std::int64_t& w) {
    checkTime(name, w);
    d = fromNanoseconds(w);
  }
  void number(const char* name, double& d, const double& w, const Limits& limits) {
    checkNumber(name, w, limits);
    d = w;
  }
  void probability(const char* name, double& d, const double& w) {
    number(name, d, w, kProbability);
  }
  template <class E>
  void choice(const char* name, E& d, const std::uint8_t& w, E last) {
    if (w > static_cast<std::uint8_t>(last)) return refuse(name, "bad_enum");
    d = static_cast<E>(w);
  }
  void text(const char* name, std::string& d, char* const& w, std::size_t longest) {
    if (w == nullptr) return d.clear();  // an older writer, or no text
    const std::string_view view(w, strnlen(w, longest + 1));
    checkText(name, view, longest);
    if (!failed()) d = view;
  }
  void name(const char* field, std::string& d, char* const& w) {
    text(field, d, w, kNameLength);
    if (d.empty()) refuse(field, "empty");
  }
  template <class M, std::size_t N>
  void matrix(const char* name, M& d, const double (&w)[N], const Limits& limits) {
    static_assert(M::SizeAtCompileTime == static_cast<int>(N));
    copyRows(d, w);
    checkMatrix(name, d, limits);
  }
  template <class M, std::size_t N>
  void symmetric(const char* name, M& d, const double (&w)[N]) {
    copyTriangle(d, w);
    checkSymmetric(name, d);
  }
  template <class M, std::size_t N>
  void covariance(const char* name, M& d, const double (&w)[N]) {
    copyTriangle(d, w);
    checkCovariance(name, d);
  }
  void unit(const char* name, Eigen::Vector3d& d, const double (&w)[3]) {
    copyRows(d, w);
    checkUnit(name, d.norm());
  }
  void pose(const char* name, RigidTransform& d, const perdure_msg_Pose& w) {
    copyRows(d.q.coeffs(), w.q);
    copyRows(d.p, w.p);
    checkUnit(name, d.q.norm());
    checkMatrix(name, d.p, kCoordinate);
  }
  template <class D, class W>
  void object(const char* name, D& d, const W& w) {
    under(name, -1, [&] { describe(*this, d, w); });
  }
  template <class D, class W>
  void optional(const char* name, std::optional<D>& d, const bool& has, const W& w) {
    if (isTrue(name, has)) object(name, d.emplace(), w);
  }
  void optionalNumber(const char* name, std::optional<double>& d, const bool& has, const double& w,
                      const Limits& limits) {
    if (isTrue(name, has)) number(name, d.emplace(), w, limits);
  }
  template <class D, class S>
  void list(const char* name, std::vector<D>& d, const S& w, std::size_t most) {
    if (!checkBuffer(name, w, most)) return;
    d.resize(w._length);
    for (std::size_t i = 0; i < d.size() && !failed(); ++i) {
      under(name, static_cast<long>(i), [&] { describe(*this, d[i], w._buffer[i]); });
    }
  }
  template <class X, class S>
  void numbers(const char* name, std::vector<X>& d, const S& w, const Limits& limits,
               std::size_t most) {
    if (!checkBuffer(name, w, most)) return;
    d.assign(w._buffer, w._buffer + w._length);
    for (const X& x : d) {
      if (!checkNumber(name, static_cast<double>(x), limits)) return;
    }
  }
  template <class S>
  void names(const char* field, std::vector<std::string>& d, const S& w, std::size_t most) {
    if (!checkBuffer(field, w, most)) return;
    d.resize(w._length);
    for (std::size_t i = 0; i < d.size(); ++i) name(field, d[i], w._buffer[i]);
  }
  template <class Counts, class S>
  void counts(const char* field, Counts& d, const S& w, std::size_t most) {
    if (!checkBuffer(field, w, most)) return;
    for (std::size_t i = 0; i < w._length; ++i) {
      std::string reason;
      name(field, reason, w._buffer[i].reason);
      d[reason] = w._buffer[i].count;
    }
  }
  template <std::size_t N>
  void bytes(const char*, std::array<std::uint8_t, N>& d, const std::uint8_t (&w)[N]) {
    std::copy(w, w + N, d.begin());
  }
  void pixels(const char* name, Frame& d, const perdure_msg_Frame& w) {
    if (!isSizeOf(d, w.pixels._length)) return refuse(name, "size_mismatch");
    if (failed() || !checkBuffer(name, w.pixels, kImageBytes)) return;
    const std::span<const std::uint8_t> bytes(w.pixels._buffer, w.pixels._length);
    if (keeper_) {
      d.data = {keeper_, bytes};
    } else {
      d.data = std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
    }
  }
  template <class Predicate>
  void ensureWire(const char* name, const char* code, Predicate holds) {
    ensure(name, code, holds);
  }

 private:
  /// An external byte may be neither 0 nor 1. It must not be read as a bool.
  bool isTrue(const char* name, const bool& w) {
    std::uint8_t byte = 0;
    std::memcpy(&byte, &w, sizeof byte);
    if (byte > 1) refuse(name, "out_of_range");
    return byte == 1;
  }
  template <class S>
  bool checkBuffer(const char* name, const S& w, std::size_t most) {
    if (!checkCount(name, w._length, most)) return false;
    if (w._length > 0 && w._buffer == nullptr) refuse(name, "size_mismatch");
    return w._length > 0 && w._buffer != nullptr;
  }
  template <class M>
  static void copyRows(M&& d, const double* w) {
    for (Eigen::Index r = 0; r < d.rows(); ++r) {
      for (Eigen::Index c = 0; c < d.cols(); ++c) d(r, c) = *w++;
    }
  }
  template <class M, std::size_t N>
  static void copyTriangle(M& d, const double (&w)[N]) {
    constexpr int n = M::RowsAtCompileTime;
    static_assert(N == n * (n + 1) / 2);
    const double* next = w;
    for (int r = 0; r < n; ++r) {
      for (int c = r; c < n; ++c) d(r, c) = d(c, r) = *next++;
    }
  }

  std::shared_ptr<const void> keeper_;
};

}  // namespace perdure::wire
