// Converts values to bytes and back for blobs of the database. The format is little-endian and
// exact: a double keeps its bits.
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
#include "common/base/time_bounds.h"

namespace perdure::map_store {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kLongestText = 4096;

class ByteWriter {
 public:
  template <std::unsigned_integral T>
  void put(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
  }
  void put(std::int64_t value) { put(static_cast<std::uint64_t>(value)); }
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
      for (Eigen::Index r = 0; r < m.rows(); ++r) put(static_cast<double>(m(r, c)));
    }
  }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

/// Reads past the end return zero and make ok() false.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <std::unsigned_integral T>
  T take() {
    if (!has(sizeof(T))) return T{};
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value |= static_cast<std::uint64_t>(bytes_[at_ + i]) << (8 * i);
    }
    at_ += sizeof(T);
    return static_cast<T>(value);
  }
  double takeReal() { return std::bit_cast<double>(take<std::uint64_t>()); }
  bool takeFlag() { return take<std::uint8_t>() != 0; }
  /// Reads a time. Makes ok() false if a message could not carry it.
  std::int64_t takeNanoseconds() {
    const auto ns = static_cast<std::int64_t>(take<std::uint64_t>());
    if (!isTime(ns)) ok_ = false;
    return ok_ ? ns : 0;
  }
  TimePoint takeTime() { return fromNanoseconds(takeNanoseconds()); }
  std::string takeText() {
    const std::size_t size = take<std::uint32_t>();
    if (size > kLongestText || !has(size)) {
      ok_ = false;
      return {};
    }
    std::string value(reinterpret_cast<const char*>(bytes_.data() + at_), size);
    at_ += size;
    return value;
  }
  /// Reads the length of a list. Returns 0 and makes ok() false if it exceeds `most`.
  std::size_t takeCount(std::size_t most) {
    const std::size_t count = take<std::uint32_t>();
    if (count > most) ok_ = false;
    return ok_ ? count : 0;
  }
  template <class Derived>
  void takeInto(Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      for (Eigen::Index r = 0; r < m.rows(); ++r) m(r, c) = takeReal();
    }
  }
  template <class Enum>
  Enum takeEnum(Enum last) {
    const auto value = take<std::uint8_t>();
    if (value > static_cast<std::uint8_t>(last)) ok_ = false;
    return ok_ ? static_cast<Enum>(value) : Enum{};
  }
  bool ok() const { return ok_; }
  bool finished() const { return ok_ && at_ == bytes_.size(); }

 private:
  bool has(std::size_t size) {
    if (!ok_ || bytes_.size() - at_ < size) ok_ = false;
    return ok_;
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace perdure::map_store
