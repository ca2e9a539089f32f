// Encodes and decodes ROS messages: CDR of ROS 2 and the format of ROS 1. CDR is written as XCDR1
// with its header of four bytes; both byte orders and plain XCDR2 are read. Input may be arbitrary
// bytes; memory is allocated only for data that exist.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "common/base/result.h"
#include "common/ros/messages.h"

namespace perdure::ros {

template <class M>
concept Struct = requires {
  M::kType;
};
/// A number, a Boolean value or a byte. In a message it is aligned to its size.
template <class X>
concept Plain = std::is_arithmetic_v<X> || std::same_as<X, std::byte>;

/// Appends a message as XCDR1, little-endian.
class CdrWriter {
 public:
  explicit CdrWriter(std::vector<std::uint8_t>& to) : to_(to) { to_.assign({0, 1, 0, 0}); }

  void operator()(const char*, const Plain auto& x) { plain(&x, sizeof x, sizeof x); }
  void operator()(const char*, const std::string& text) {
    count(text.size() + 1);
    plain(text.c_str(), text.size() + 1, 1);
  }
  void operator()(const char*, const SharedBytes& bytes) {
    count(bytes->size());
    plain(bytes->data(), bytes->size(), 1);
  }
  template <Plain X, std::size_t N>
  void operator()(const char*, const std::array<X, N>& numbers) {
    plain(numbers.data(), sizeof numbers, sizeof(X));
  }
  template <class X>
  void operator()(const char* name, const std::vector<X>& items) {
    count(items.size());
    for (const X& item : items) (*this)(name, item);
  }
  void operator()(const char*, const Struct auto& message) { message.fields(message, *this); }

 private:
  void count(std::size_t n) { (*this)("", static_cast<std::uint32_t>(n)); }
  void plain(const void* bytes, std::size_t size, std::size_t alignment) {
    static_assert(std::endian::native == std::endian::little);
    constexpr std::size_t kHead = 4;
    if (size == 0) return;
    const std::size_t used = (to_.size() - kHead) % alignment;
    to_.resize(to_.size() + (used == 0 ? 0 : alignment - used));
    const auto* from = static_cast<const std::uint8_t*>(bytes);
    to_.insert(to_.end(), from, from + size);
  }

  std::vector<std::uint8_t>& to_;
};

enum class Encoding { kCdr, kRos1 };

/// Reads the values of a message in order. After the first missing value it reads no further.
class BytesReader {
 public:
  /// `keeper` owns the memory of `bytes`. Images refer to this memory without a copy.
  BytesReader(std::span<const std::uint8_t> bytes, Encoding encoding,
              std::shared_ptr<const void> keeper);

  bool whole() const { return whole_; }

  template <Plain X>
  void operator()(const char*, X& x) {
    std::array<std::uint8_t, sizeof(X)> raw{};
    if (!take(raw.data(), sizeof(X), sizeof(X))) return;
    if (swapped_) std::ranges::reverse(raw);
    if constexpr (std::same_as<X, bool>) {
      x = raw[0] != 0;
    } else {
      x = std::bit_cast<X>(raw);
    }
  }
  void operator()(const char*, std::string& text);
  void operator()(const char*, SharedBytes& bytes);
  template <Plain X, std::size_t N>
  void operator()(const char* name, std::array<X, N>& numbers) {
    for (X& x : numbers) (*this)(name, x);
  }
  template <class X>
  void operator()(const char* name, std::vector<X>& items) {
    items.clear();
    for (std::uint32_t n = count(); n > 0 && whole_; --n) (*this)(name, items.emplace_back());
  }
  template <Struct M>
  void operator()(const char* name, M& message) {
    if (std::same_as<M, Header> && encoding_ == Encoding::kRos1) {
      std::uint32_t sequence = 0;
      (*this)(name, sequence);
    }
    M::fields(message, *this);
  }

 private:
  bool take(void* to, std::size_t size, std::size_t alignment);
  std::uint32_t count();
  std::span<const std::uint8_t> part(std::size_t size);

  std::span<const std::uint8_t> bytes_;
  Encoding encoding_;
  std::shared_ptr<const void> keeper_;
  std::size_t at_ = 0, most_alignment_ = 8;
  bool swapped_ = false, whole_ = true;
};

std::vector<std::uint8_t> cdrOf(const Struct auto& message) {
  std::vector<std::uint8_t> bytes;
  CdrWriter writer(bytes);
  writer("", message);
  return bytes;
}

/// Decodes a message. Reason: "malformed" if the bytes end before the message.
template <Struct M>
Result<M> messageOf(std::span<const std::uint8_t> bytes, Encoding encoding,
                    std::shared_ptr<const void> keeper) {
  M message;
  BytesReader reader(bytes, encoding, std::move(keeper));
  reader("", message);
  if (!reader.whole()) return fail("malformed", std::string("no whole ") + M::kType);
  return message;
}

}  // namespace perdure::ros
