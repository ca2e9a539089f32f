// Immutable bytes with several owners: a vector, or a part of a larger buffer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace perdure {

class SharedBytes {
 public:
  SharedBytes() = default;
  SharedBytes(std::nullptr_t) {}
  SharedBytes(std::shared_ptr<const std::vector<std::uint8_t>> bytes)
      : keeper_(bytes), bytes_(bytes ? std::span(*bytes) : std::span<const std::uint8_t>()) {}
  SharedBytes(std::shared_ptr<std::vector<std::uint8_t>> bytes)
      : SharedBytes(std::shared_ptr<const std::vector<std::uint8_t>>(std::move(bytes))) {}
  /// `keeper` owns the memory to which `bytes` refers.
  SharedBytes(std::shared_ptr<const void> keeper, std::span<const std::uint8_t> bytes)
      : keeper_(std::move(keeper)), bytes_(bytes) {}

  explicit operator bool() const { return keeper_ != nullptr; }
  bool operator==(std::nullptr_t) const { return keeper_ == nullptr; }
  const std::span<const std::uint8_t>& operator*() const { return bytes_; }
  const std::span<const std::uint8_t>* operator->() const { return &bytes_; }

 private:
  std::shared_ptr<const void> keeper_;
  std::span<const std::uint8_t> bytes_;
};

}  // namespace perdure
