// Fuzzing: random fields of valid messages are damaged. The decoder must return a sound value or a
// reason, and each accepted value must be sound enough to be encoded again.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>

#include "common/wire/codec.h"
#include "common/wire/topics.h"
#include "tests/common/wire/all_messages.h"
#include "tests/common/wire/examples.h"

namespace perdure::wire {
namespace {

/// An archive that damages random wire values.
class Vandal {
 public:
  explicit Vandal(unsigned seed) : random_(seed) {}

  template <class X>
  void value(const char*, X&, X& w) {
    if (strikes()) w = static_cast<X>(random_.bits());
  }
  void value(const char*, bool&, bool& w) {
    if (strikes()) w = !w;
  }
  void time(const char*, TimePoint&, std::int64_t& w) {
    if (strikes()) w = static_cast<std::int64_t>(random_.bits());
  }
  void number(const char*, double&, double& w, const Limits&) { damage(w); }
  void probability(const char*, double&, double& w) { damage(w); }
  template <class E>
  void choice(const char*, E&, std::uint8_t& w, E) {
    if (strikes()) w = static_cast<std::uint8_t>(random_.bits());
  }
  void text(const char*, std::string&, char*& w, std::size_t) {
    if (!strikes()) return;
    texts_.push_back(std::string(random_.below(600), static_cast<char>(random_.bits())));
    w = random_.below(4) == 0 ? nullptr : texts_.back().data();
  }
  void name(const char* field, std::string& d, char*& w) { text(field, d, w, 0); }
  template <class M, class W, std::size_t N>
  void matrix(const char*, M&, W (&w)[N], const Limits&) {
    damage(w[random_.below(N)]);
  }
  template <class M, std::size_t N>
  void symmetric(const char*, M&, double (&w)[N]) {
    damage(w[random_.below(N)]);
  }
  template <class M, std::size_t N>
  void covariance(const char*, M&, double (&w)[N]) {
    damage(w[random_.below(N)]);
  }
  void unit(const char*, Eigen::Vector3d&, double (&w)[3]) { damage(w[random_.below(3)]); }
  void pose(const char*, RigidTransform&, perdure_msg_Pose& w) {
    damage(w.q[random_.below(4)]);
    damage(w.p[random_.below(3)]);
  }
  template <class D, class W>
  void object(const char*, D& d, W& w) {
    describe(*this, d, w);
  }
  template <class D, class W>
  void optional(const char*, std::optional<D>&, bool& has, W& w) {
    D unused;
    if (strikes()) has = !has;
    describe(*this, unused, w);
  }
  void optionalNumber(const char*, std::optional<double>&, bool& has, double& w, const Limits&) {
    if (strikes()) has = !has;
    damage(w);
  }
  template <class D, class S>
  void list(const char*, std::vector<D>&, S& w, std::size_t) {
    D unused;
    for (std::uint32_t i = 0; i < w._length; ++i) describe(*this, unused, w._buffer[i]);
    shorten(w);
  }
  template <class X, class S>
  void numbers(const char*, std::vector<X>&, S& w, const Limits&, std::size_t) {
    for (std::uint32_t i = 0; i < w._length; ++i) damage(w._buffer[i]);
    shorten(w);
  }
  template <class S>
  void names(const char* field, std::vector<std::string>&, S& w, std::size_t) {
    std::string unused;
    for (std::uint32_t i = 0; i < w._length; ++i) name(field, unused, w._buffer[i]);
    shorten(w);
  }
  template <class Counts, class S>
  void counts(const char* field, Counts&, S& w, std::size_t) {
    std::string unused;
    for (std::uint32_t i = 0; i < w._length; ++i) name(field, unused, w._buffer[i].reason);
    shorten(w);
  }
  template <class D, class W>
  void bytes(const char*, D&, W&) {}
  void pixels(const char*, Frame&, perdure_msg_Frame& w) { shorten(w.pixels); }
  template <class Predicate>
  void ensure(const char*, const char*, Predicate) {}
  template <class Predicate>
  void ensureWire(const char*, const char*, Predicate) {}

 private:
  bool strikes() { return random_.below(40) == 0; }
  template <class X>
  void damage(X& w) {
    using L = std::numeric_limits<X>;
    const X choices[] = {L::quiet_NaN(),  L::infinity(), -L::infinity(), L::max(), L::lowest(),
                         L::denorm_min(), X(0),          X(-1),          -w,       w * X(1e9),
                         X(1.0000001) * w};
    if (strikes()) w = choices[random_.below(std::size(choices))];
  }
  /// A length may decrease, or the buffer may be missing; Cyclone never gives a length beyond the
  /// buffer.
  template <class S>
  void shorten(S& w) {
    if (!strikes()) return;
    w._length = w._length > 0 ? random_.below(w._length) : 0;
    if (random_.coin()) w._buffer = nullptr;
  }

  Examples random_;
  std::deque<std::string> texts_;
};

template <class T>
class Damaged : public testing::Test {};
TYPED_TEST_SUITE(Damaged, AllMessages);

TYPED_TEST(Damaged, MessagesGiveASoundValueOrAReason) {
  int refused = 0, accepted = 0;
  Arena arena, other;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    TypeParam message, unused;
    Examples(seed).fill(message);
    typename Type<TypeParam>::Wire wire, again;
    ASSERT_TRUE(encode(message, wire, arena));
    Vandal vandal(seed);
    describe(vandal, unused, wire);
    const Result<TypeParam> decoded = decode<TypeParam>(wire);
    if (decoded) {
      ++accepted;
      const Result<void> encoded = encode(*decoded, again, other);
      ASSERT_TRUE(encoded) << encoded.error().code << " " << encoded.error().detail;
    } else {
      ++refused;
      ASSERT_FALSE(decoded.error().code.empty());
      ASSERT_FALSE(decoded.error().detail.empty());
    }
  }
  EXPECT_GT(refused, 20);
  EXPECT_GT(accepted, 20);
}

}  // namespace
}  // namespace perdure::wire
