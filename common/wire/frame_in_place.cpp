#include "common/wire/frame_in_place.h"

#include <cstring>
#include <type_traits>

namespace perdure::wire {
namespace {

class Cursor {
 public:
  explicit Cursor(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <class X>
  bool value(X& x) {
    static_assert(std::is_arithmetic_v<X>);
    at_ = (at_ + sizeof(X) - 1) / sizeof(X) * sizeof(X);
    if (!has(sizeof(X))) return false;
    std::memcpy(&x, bytes_.data() + at_, sizeof(X));
    at_ += sizeof(X);
    return true;
  }
  /// Reads a length n and the next n bytes.
  bool counted(std::span<const std::uint8_t>& part) {
    std::uint32_t length = 0;
    if (!value(length) || !has(length)) return false;
    part = bytes_.subspan(at_, length);
    at_ += length;
    return true;
  }

 private:
  bool has(std::size_t n) const { return at_ <= bytes_.size() && n <= bytes_.size() - at_; }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

/// Returns a mutable pointer for Cyclone's C types, which lack const. The data are only read.
template <class X>
X* borrowed(std::span<const std::uint8_t> bytes) {
  return reinterpret_cast<X*>(const_cast<std::uint8_t*>(bytes.data()));
}

}  // namespace

bool frameInPlace(std::span<const std::uint8_t> cdr, perdure_msg_Frame& wire) {
  Cursor cursor(cdr);
  std::span<const std::uint8_t> camera, pixels;
  perdure_msg_FrameStamp& stamp = wire.stamp;
  const bool whole =
      cursor.value(stamp.source) && cursor.value(stamp.seq) && cursor.value(stamp.time_ns) &&
      cursor.value(stamp.captured_ns) && cursor.counted(camera) && cursor.value(wire.width) &&
      cursor.value(wire.height) && cursor.value(wire.encoding) && cursor.counted(pixels);
  if (!whole || camera.empty() || camera.back() != 0) return false;
  wire.camera = borrowed<char>(camera);
  wire.pixels._buffer = borrowed<std::uint8_t>(pixels);
  wire.pixels._length = wire.pixels._maximum = static_cast<std::uint32_t>(pixels.size());
  wire.pixels._release = false;
  return true;
}

std::size_t sizeInPlace(const perdure_msg_Frame& wire) {
  const auto aligned = [](std::size_t n) { return (n + 3) / 4 * 4; };
  constexpr std::size_t kStamp = 32, kNumber = 4;
  const std::size_t text = kStamp + kNumber + std::strlen(wire.camera) + 1;
  const std::size_t numbers = aligned(text) + 2 * kNumber + 1;
  return aligned(numbers) + kNumber + wire.pixels._length;
}

}  // namespace perdure::wire
