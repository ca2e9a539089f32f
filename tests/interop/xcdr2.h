// XCDR2 with delimited (@appendable) structs, as OMG DDS-XTypes 1.3, 7.4.3 has it: what Fast
// DDS 2.9 of Debian 12 lacks. Numbers are aligned to at most 4; each appendable struct, and each
// sequence of structs or strings, is preceded by its size, so that a reader may skip what it does
// not know.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace perdure::interop {

inline constexpr std::uint8_t kDelimitedLittleEndian[4] = {0x00, 0x09, 0x00, 0x00};

class Xcdr2Writer {
 public:
  template <class T>
  void number(T value) {
    align(sizeof(T));
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), raw, raw + sizeof(T));
  }
  template <class T, std::size_t N>
  void numbers(const std::array<T, N>& values) {
    for (const T& v : values) number(v);
  }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
  }
  /// What `write` writes, with its size before it.
  template <class Write>
  void delimited(Write write) {
    number(std::uint32_t{0});
    const std::size_t begin = bytes_.size();
    write();
    const auto size = static_cast<std::uint32_t>(bytes_.size() - begin);
    std::memcpy(&bytes_[begin - sizeof size], &size, sizeof size);
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  void align(std::size_t size) {
    const std::size_t to = size < 4 ? size : 4;
    while (bytes_.size() % to != 0) bytes_.push_back(0);
  }
  std::vector<std::uint8_t> bytes_;
};

/// Throws std::out_of_range where the bytes end too early.
class Xcdr2Reader {
 public:
  Xcdr2Reader(const std::uint8_t* data, std::size_t size) : data_(data), end_(size) {}

  template <class T>
  T number() {
    const std::size_t to = sizeof(T) < 4 ? sizeof(T) : 4;
    at_ = (at_ + to - 1) / to * to;
    T value;
    std::memcpy(&value, take(sizeof(T)), sizeof(T));
    return value;
  }
  template <class T, std::size_t N>
  std::array<T, N> numbers() {
    std::array<T, N> values;
    for (T& v : values) v = number<T>();
    return values;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();
    const auto* begin = reinterpret_cast<const char*>(take(size));
    return size == 0 ? std::string() : std::string(begin, size - 1);
  }
  /// `read` may read less than there is: the rest is skipped.
  template <class Read>
  void delimited(Read read) {
    const auto size = number<std::uint32_t>();
    const std::size_t end = at_ + size;
    read();
    if (at_ > end || end > end_) throw std::out_of_range("a delimited struct");
    at_ = end;
  }

 private:
  const std::uint8_t* take(std::size_t size) {
    if (size > end_ - at_ || at_ > end_) throw std::out_of_range("the message is cut off");
    const std::uint8_t* begin = data_ + at_;
    at_ += size;
    return begin;
  }
  const std::uint8_t* data_;
  std::size_t end_, at_ = 0;
};

}  // namespace perdure::interop
