#include "common/ros/bytes.h"

#include <algorithm>

namespace perdure::ros {
namespace {

constexpr std::size_t kHead = 4;
/// Second byte of the CDR header: the lowest bit is the byte order, the others are the encoding.
enum : std::uint8_t { kLittle = 1, kXcdr1 = 0, kXcdr2 = 6 };

}  // namespace

BytesReader::BytesReader(std::span<const std::uint8_t> bytes, Encoding encoding,
                         std::shared_ptr<const void> keeper)
    : bytes_(bytes), encoding_(encoding), keeper_(std::move(keeper)) {
  if (encoding == Encoding::kRos1) return;
  const std::uint8_t rules = bytes.size() >= kHead ? bytes[1] & ~kLittle : 0xFF;
  whole_ = bytes.size() >= kHead && bytes[0] == 0 && (rules == kXcdr1 || rules == kXcdr2);
  if (!whole_) return;
  swapped_ = (bytes[1] & kLittle) == 0;
  if (rules == kXcdr2) most_alignment_ = 4;
  bytes_ = bytes.subspan(kHead);
}

bool BytesReader::take(void* to, std::size_t size, std::size_t alignment) {
  if (encoding_ == Encoding::kCdr) {
    const std::size_t step = std::min(alignment, most_alignment_);
    at_ = (at_ + step - 1) / step * step;
  }
  const auto from = part(size);
  if (!whole_) return false;
  std::memcpy(to, from.data(), size);
  return true;
}

std::span<const std::uint8_t> BytesReader::part(std::size_t size) {
  whole_ = whole_ && at_ <= bytes_.size() && size <= bytes_.size() - at_;
  if (!whole_) return {};
  const auto from = bytes_.subspan(at_, size);
  at_ += size;
  return from;
}

std::uint32_t BytesReader::count() {
  std::uint32_t n = 0;
  (*this)("", n);
  return n;
}

void BytesReader::operator()(const char*, std::string& text) {
  auto from = part(count());
  if (encoding_ == Encoding::kCdr && !from.empty()) from = from.first(from.size() - 1);
  text.assign(from.begin(), from.end());
}

void BytesReader::operator()(const char*, SharedBytes& bytes) {
  bytes = SharedBytes(keeper_, part(count()));
}

}  // namespace perdure::ros
