// Encodes domain types into wire types, or decodes them, and checks every field. Stores the first
// refusal of a message, with the path of its field. Internal to common/wire.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/wire/arena.h"
#include "common/wire/checks.h"

namespace perdure::wire {

/// In each field's function, `d` is the domain value and `w` the value on the wire.
template <bool kEncodes>
class Coder {
  template <class X>
  using Domain = std::conditional_t<kEncodes, const X, X>;
  template <class X>
  using Wire = std::conditional_t<kEncodes, X, const X>;
  using Memory = std::conditional_t<kEncodes, Arena&, std::shared_ptr<const void>>;

 public:
  /// `memory`: the arena for encoded sequences; or the owner of the message to decode, whose pixels
  /// are then not copied.
  explicit Coder(Memory memory) : memory_(std::forward<Memory>(memory)) {}

  bool failed() const { return reason_.has_value(); }
  const Reason& reason() const { return reason_.value(); }

  template <class D, class W>
  void value(const char* name, D& d, W& w) {
    static_assert(std::is_same_v<std::remove_const_t<D>, std::remove_const_t<W>>);
    if constexpr (!kEncodes && std::is_same_v<D, bool>) {
      d = isTrue(name, w);
    } else {
      copy(d, w);
    }
  }
  void time(const char* name, Domain<TimePoint>& d, Wire<std::int64_t>& w) {
    if constexpr (kEncodes) w = toNanoseconds(d);
    if (!isTime(w)) refuse(name, "out_of_range");
    if constexpr (!kEncodes) d = fromNanoseconds(w);
  }
  void number(const char* name, Domain<double>& d, Wire<double>& w, const Limits& limits) {
    copy(d, w);
    checkNumber(name, d, limits);
  }
  /// Values slightly outside [0, 1] due to rounding are sent as 0 or 1.
  void probability(const char* name, Domain<double>& d, Wire<double>& w) {
    constexpr double kRounding = kEncodes ? 1e-9 : 0.0;
    number(name, d, w, {kProbability.low - kRounding, kProbability.high + kRounding});
    if constexpr (kEncodes) w = std::clamp(d, kProbability.low, kProbability.high);
  }
  template <class E>
  void choice(const char* name, E& d, Wire<std::uint8_t>& w, std::remove_const_t<E> last) {
    if constexpr (kEncodes) w = static_cast<std::uint8_t>(d);
    if (w > static_cast<std::uint8_t>(last)) return refuse(name, "bad_enum");
    if constexpr (!kEncodes) d = static_cast<E>(w);
  }
  void text(const char* name, Domain<std::string>& d, Wire<char*>& w, std::size_t longest) {
    if constexpr (kEncodes) {
      checkText(name, d, longest);
      w = const_cast<char*>(d.c_str());  // Cyclone's C types lack const; the text is only read
    } else {
      if (w == nullptr) return d.clear();  // the writer is older, or the text is empty
      const std::string_view view(w, strnlen(w, longest + 1));
      checkText(name, view, longest);
      if (!failed()) d = view;
    }
  }
  void name(const char* field, Domain<std::string>& d, Wire<char*>& w) {
    text(field, d, w, kNameLength);
    if (d.empty()) refuse(field, "empty");
  }
  template <class M, class W, std::size_t N>
  void matrix(const char* name, M& d, W (&w)[N], const Limits& limits) {
    static_assert(M::SizeAtCompileTime == static_cast<int>(N));
    copyRows(d, w);
    checkMatrix(name, d, limits);
  }
  void symmetric(const char* name, auto& d, auto& w) {
    copyTriangle(name, d, w);
    if (!failed() && !isSemiDefinite(d)) refuse(name, "bad_covariance");
  }
  void covariance(const char* name, auto& d, auto& w) {
    copyTriangle(name, d, w);
    if (!failed() && !isDefinite(d)) refuse(name, "bad_covariance");
  }
  void unit(const char* name, Domain<Eigen::Vector3d>& d, Wire<double> (&w)[3]) {
    copyRows(d, w);
    checkUnit(name, d.norm());
  }
  void pose(const char* name, Domain<RigidTransform>& d, Wire<perdure_msg_Pose>& w) {
    copyRows(d.q.coeffs(), w.q);
    copyRows(d.p, w.p);
    checkUnit(name, d.q.norm());
    checkMatrix(name, d.p, kCoordinate);
  }
  void object(const char* name, auto& d, auto& w) {
    under(name, -1, [&] { describe(*this, d, w); });
  }
  void optional(const char* name, auto& d, Wire<bool>& has, auto& w) {
    if (exists(name, d, has)) object(name, *d, w);
  }
  void optionalNumber(const char* name, Domain<std::optional<double>>& d, Wire<bool>& has,
                      Wire<double>& w, const Limits& limits) {
    if (exists(name, d, has)) number(name, *d, w, limits);
  }
  void list(const char* name, auto& d, auto& w, std::size_t most) {
    if (!resize(name, d, w, most)) return;
    for (std::size_t i = 0; i < d.size() && !failed(); ++i) {
      under(name, static_cast<long>(i), [&] { describe(*this, d[i], w._buffer[i]); });
    }
  }
  void numbers(const char* name, auto& d, auto& w, const Limits& limits, std::size_t most) {
    if (!resize(name, d, w, most)) return;
    for (std::size_t i = 0; i < d.size(); ++i) {
      copy(d[i], w._buffer[i]);
      if (!checkNumber(name, static_cast<double>(d[i]), limits)) return;
    }
  }
  void names(const char* field, auto& d, auto& w, std::size_t most) {
    if (!resize(field, d, w, most)) return;
    for (std::size_t i = 0; i < d.size(); ++i) name(field, d[i], w._buffer[i]);
  }
  void counts(const char* field, auto& d, auto& w, std::size_t most) {
    if constexpr (kEncodes) {
      if (!resize(field, d, w, most)) return;
      std::size_t i = 0;
      for (const auto& [reason, count] : d) {
        name(field, reason, w._buffer[i].reason);
        w._buffer[i++].count = count;
      }
    } else {
      if (!checkBuffer(field, w, most)) return;
      for (std::size_t i = 0; i < w._length; ++i) {
        std::string reason;
        name(field, reason, w._buffer[i].reason);
        d[reason] = w._buffer[i].count;
      }
    }
  }
  template <class W, std::size_t N>
  void bytes(const char*, Domain<std::array<std::uint8_t, N>>& d, W (&w)[N]) {
    for (std::size_t i = 0; i < N; ++i) copy(d[i], w[i]);
  }
  void pixels(const char* name, Domain<Frame>& d, Wire<perdure_msg_Frame>& w) {
    if constexpr (kEncodes) {
      if (!d.data || !isSizeOf(d, d.data->size())) return refuse(name, "size_mismatch");
      if (!checkCount(name, d.data->size(), kImageBytes)) return;
      w.pixels._buffer = const_cast<std::uint8_t*>(d.data->data());  // the data are not modified
      w.pixels._length = w.pixels._maximum = static_cast<std::uint32_t>(d.data->size());
      w.pixels._release = false;
    } else {
      if (!isSizeOf(d, w.pixels._length)) return refuse(name, "size_mismatch");
      if (failed() || !checkBuffer(name, w.pixels, kImageBytes)) return;
      const std::span<const std::uint8_t> bytes(w.pixels._buffer, w.pixels._length);
      if (memory_) {
        d.data = {memory_, bytes};
      } else {
        d.data = std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
      }
    }
  }
  /// Refuses the value with `code` unless holds(). `holds` is called only for values that were
  /// read.
  void ensure(const char* name, const char* code, auto holds) {
    if (!failed() && !holds()) refuse(name, code);
  }
  /// The same for a value on the wire without a counterpart in the domain type.
  void ensureWire(const char* name, const char* code, auto holds) {
    if constexpr (!kEncodes) ensure(name, code, holds);
  }

 private:
  void refuse(const char* name, const char* code) {
    if (failed()) return;
    std::string path;
    for (const Step& step : path_) {
      path += step.name;
      path += step.index < 0 ? "." : "[" + std::to_string(step.index) + "].";
    }
    reason_ = Reason{code, path + name};
  }
  bool checkNumber(const char* name, double value, const Limits& limits) {
    if (inside(value, limits)) return true;
    refuse(name, std::isfinite(value) ? "out_of_range" : "not_finite");
    return false;
  }
  void checkUnit(const char* name, double norm) {
    if (!std::isfinite(norm)) return refuse(name, "not_finite");
    if (std::abs(norm - 1.0) > kUnitTolerance) refuse(name, "bad_rotation");
  }
  void checkMatrix(const char* name, const auto& m, const Limits& limits) {
    for (Eigen::Index i = 0; i < m.size(); ++i) {
      if (!checkNumber(name, m(i % m.rows(), i / m.rows()), limits)) return;
    }
  }
  void checkText(const char* name, std::string_view text, std::size_t longest) {
    if (text.size() > longest) return refuse(name, "over_bound");
    if (!isText(text)) refuse(name, "bad_text");
  }
  bool checkCount(const char* name, std::size_t count, std::size_t most) {
    if (count > most) refuse(name, "over_bound");
    return count <= most;
  }
  bool checkBuffer(const char* name, const auto& w, std::size_t most) {
    if (!checkCount(name, w._length, most)) return false;
    if (w._length > 0 && w._buffer == nullptr) refuse(name, "size_mismatch");
    return w._length > 0 && w._buffer != nullptr;
  }
  /// Returns a bool from outside. Refuses bytes other than 0 and 1, which must not be read as a
  /// bool.
  bool isTrue(const char* name, const bool& w) {
    std::uint8_t byte = 0;
    std::memcpy(&byte, &w, sizeof byte);
    if (byte > 1) refuse(name, "out_of_range");
    return byte == 1;
  }
  bool exists(const char* name, auto& d, Wire<bool>& has) {
    if constexpr (kEncodes) {
      has = d.has_value();
    } else if (isTrue(name, has)) {
      d.emplace();
    }
    return d.has_value();
  }
  /// Resizes the target to the length of the source. Returns false if the elements must not be
  /// copied.
  bool resize(const char* name, auto& d, auto& w, std::size_t most) {
    if constexpr (kEncodes) {
      if (!checkCount(name, d.size(), most)) return false;
      w._buffer = memory_.template allocate<std::remove_pointer_t<decltype(w._buffer)>>(d.size());
      w._length = w._maximum = static_cast<std::uint32_t>(d.size());
      w._release = false;
    } else {
      if (!checkBuffer(name, w, most)) return false;
      d.resize(w._length);
    }
    return true;
  }
  static void copy(auto& d, auto& w) {
    if constexpr (kEncodes) {
      w = d;
    } else {
      d = w;
    }
  }
  static void copyRows(auto&& d, auto* w) {
    for (Eigen::Index r = 0; r < d.rows(); ++r) {
      for (Eigen::Index c = 0; c < d.cols(); ++c) copy(d(r, c), *w++);
    }
  }
  template <class M, class W, std::size_t N>
  void copyTriangle(const char* name, M& d, W (&w)[N]) {
    constexpr int n = M::RowsAtCompileTime;
    static_assert(N == n * (n + 1) / 2);
    auto* next = w;
    for (int r = 0; r < n; ++r) {
      for (int c = r; c < n; ++c, ++next) {
        copy(d(r, c), *next);
        if constexpr (!kEncodes) d(c, r) = d(r, c);
      }
    }
    checkMatrix(name, d, kMatrixEntry);
  }
  void under(const char* name, long index, auto visit) {
    path_.push_back({name, index});
    visit();
    path_.pop_back();
  }

  struct Step {
    const char* name;
    long index;  // -1: not a list element
  };
  Memory memory_;
  std::vector<Step> path_;
  std::optional<Reason> reason_;
};

}  // namespace perdure::wire
