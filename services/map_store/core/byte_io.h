// Converts values to little-endian bytes and back, without loss. ByteWriter and ByteReader have the
// same functions, so that one function `fields(io, value)` serves both.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/time.h"

namespace perdure::map_store {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kLongestText = 4096;

class ByteWriter {
 public:
  void operator()(const auto&... values) { (put(values), ...); }
  void enumeration(auto value, auto /*last*/) { put(static_cast<std::uint8_t>(value)); }
  void list(const auto& values, std::size_t /*most*/, auto fields) {
    put(static_cast<std::uint32_t>(values.size()));
    for (const auto& each : values) fields(*this, each);
  }
  void optional(const auto& value, auto fields) {
    put(value.has_value());
    if (value) fields(*this, *value);
  }
  Bytes take() { return std::move(bytes_); }

 private:
  template <std::unsigned_integral T>
  void put(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
  }
  void put(std::int64_t value) { put(static_cast<std::uint64_t>(value)); }
  void put(float value) { put(std::bit_cast<std::uint32_t>(value)); }
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }
  void put(bool value) { put(static_cast<std::uint8_t>(value)); }
  void put(TimePoint value) { put(toNanoseconds(value)); }
  void put(const std::string& value) {
    put(static_cast<std::uint32_t>(value.size()));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
  }
  template <class Derived>
  void put(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      for (Eigen::Index r = 0; r < m.rows(); ++r) put(m(r, c));
    }
  }
  Bytes bytes_;
};

/// Reads values that ByteWriter wrote. A read past the end gives zero and makes ok() false.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  void operator()(auto&... values) { (take(values), ...); }
  /// Makes ok() false if the value exceeds `last`.
  template <class Enum>
  void enumeration(Enum& value, Enum last) {
    const auto number = taken<std::uint8_t>();
    if (number > static_cast<std::uint8_t>(last)) ok_ = false;
    value = ok_ ? static_cast<Enum>(number) : Enum{};
  }
  /// Makes ok() false if the list has more than `most` elements.
  void list(auto& values, std::size_t most, auto fields) {
    const std::size_t count = taken<std::uint32_t>();
    if (count > most) ok_ = false;
    for (std::size_t i = 0; i < count && ok_; ++i) fields(*this, values.emplace_back());
  }
  void optional(auto& value, auto fields) {
    if (taken<std::uint8_t>() != 0) fields(*this, value.emplace());
  }
  bool ok() const { return ok_; }
  bool finished() const { return ok_ && at_ == bytes_.size(); }

 private:
  bool has(std::size_t size) {
    if (!ok_ || bytes_.size() - at_ < size) ok_ = false;
    return ok_;
  }
  template <std::unsigned_integral T>
  T taken() {
    if (!has(sizeof(T))) return T{};
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value |= static_cast<std::uint64_t>(bytes_[at_ + i]) << (8 * i);
    }
    at_ += sizeof(T);
    return static_cast<T>(value);
  }
  template <std::unsigned_integral T>
  void take(T& value) {
    value = taken<T>();
  }
  /// Reads a time in nanoseconds. Makes ok() false if it is not a valid time of a message.
  void take(std::int64_t& ns) {
    ns = static_cast<std::int64_t>(taken<std::uint64_t>());
    if (!isTime(ns)) ok_ = false;
    if (!ok_) ns = 0;
  }
  void take(float& value) { value = std::bit_cast<float>(taken<std::uint32_t>()); }
  void take(double& value) { value = std::bit_cast<double>(taken<std::uint64_t>()); }
  void take(bool& value) { value = taken<std::uint8_t>() != 0; }
  void take(TimePoint& value) {
    std::int64_t ns = 0;
    take(ns);
    value = fromNanoseconds(ns);
  }
  void take(std::string& value) {
    const std::size_t size = taken<std::uint32_t>();
    if (size > kLongestText || !has(size)) {
      ok_ = false;
      return;
    }
    value.assign(reinterpret_cast<const char*>(bytes_.data() + at_), size);
    at_ += size;
  }
  template <class Derived>
  void take(Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      for (Eigen::Index r = 0; r < m.rows(); ++r) take(m(r, c));
    }
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// Returns the version and the fields of a value as bytes.
Bytes encode(std::uint16_t version, const auto& value, auto fields) {
  ByteWriter out;
  out(version);
  fields(out, value);
  return out.take();
}

}  // namespace perdure::map_store
