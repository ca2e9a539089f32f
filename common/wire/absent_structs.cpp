#include "common/wire/absent_structs.h"

#include <dds/ddsc/dds_opcodes.h>

#include <algorithm>
#include <cstring>
#include <optional>

namespace perdure::wire {
namespace {

using Op = std::uint32_t;

/// Size of one number in bytes. Returns nothing for other kinds.
std::optional<std::size_t> sizeOf(dds_stream_typecode kind) {
  if (kind == DDS_OP_VAL_BLN) return 1;
  if (kind < DDS_OP_VAL_1BY || kind > DDS_OP_VAL_8BY) return std::nullopt;
  return std::size_t{1} << (kind - DDS_OP_VAL_1BY);
}

/// Follows a message by Cyclone's operations, as Cyclone does, and reads lengths only.
class Walk {
 public:
  explicit Walk(std::span<const std::uint8_t> cdr) : cdr_(cdr) {}

  bool structure(const Op* ops) {
    const bool delimited = DDS_OP(*ops) == DDS_OP_DLC;
    const std::size_t size = delimited ? number() : SIZE_MAX, start = at_;
    if (delimited) ++ops;
    while (ops != nullptr && *ops != DDS_OP_RTS) {
      if (DDS_OP(*ops) != DDS_OP_ADR) return false;
      ops = at_ - start < size ? member(ops) : absent(ops);
    }
    if (delimited) at_ = std::max(at_, std::min(cdr_.size() - start, size) + start);
    return ops != nullptr && at_ <= cdr_.size();
  }

 private:
  const Op* member(const Op* ops) {
    const auto kind = DDS_OP_TYPE(*ops);
    if (kind == DDS_OP_VAL_SEQ) return sequence(ops);
    if (kind == DDS_OP_VAL_STR) return text(), ops + 2;
    if (const auto size = sizeOf(kind)) return skip(*size, 1), ops + 2;
    const auto element = sizeOf(DDS_OP_SUBTYPE(*ops));
    if (kind == DDS_OP_VAL_ARR && element) return skip(*element, ops[2]), ops + 3;
    if (kind != DDS_OP_VAL_EXT || !structure(ops + DDS_OP_ADR_JSR(ops[2]))) return nullptr;
    return ops + DDS_OP_ADR_JMP(ops[2]);
  }

  const Op* sequence(const Op* ops) {
    const auto kind = DDS_OP_SUBTYPE(*ops);
    const auto size = sizeOf(kind);
    if (!size) number();  // size of all elements in bytes
    const std::uint32_t count = number();
    if (size) return skip(*size, count), ops + 2;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (at_ >= cdr_.size()) return nullptr;
      if (kind == DDS_OP_VAL_STR) {
        text();
      } else if (kind != DDS_OP_VAL_STU || !structure(ops + DDS_OP_ADR_JSR(ops[3]))) {
        return nullptr;
      }
    }
    return kind == DDS_OP_VAL_STR ? ops + 2 : ops + DDS_OP_ADR_JMP(ops[3]);
  }

  /// Handles a member that is missing in the message; returns nullptr if Cyclone would abort.
  static const Op* absent(const Op* ops) {
    const auto kind = DDS_OP_TYPE(*ops), part = DDS_OP_SUBTYPE(*ops);
    if (kind == DDS_OP_VAL_STR || sizeOf(kind)) return ops + 2;
    if (kind == DDS_OP_VAL_ARR && sizeOf(part)) return ops + 3;
    if (kind == DDS_OP_VAL_SEQ && part == DDS_OP_VAL_STU) return ops + DDS_OP_ADR_JMP(ops[3]);
    if (kind == DDS_OP_VAL_SEQ && (part == DDS_OP_VAL_STR || sizeOf(part))) return ops + 2;
    if (kind != DDS_OP_VAL_EXT) return nullptr;
    for (const Op* inner = ops + DDS_OP_ADR_JSR(ops[2]); *inner != DDS_OP_RTS;) {
      if (DDS_OP(*inner) != DDS_OP_ADR) return nullptr;
      inner = absent(inner);
      if (inner == nullptr) return nullptr;
    }
    return ops + DDS_OP_ADR_JMP(ops[2]);
  }

  std::uint32_t number() {
    std::uint32_t value = 0;
    skip(sizeof(value), 1);
    if (at_ <= cdr_.size()) std::memcpy(&value, cdr_.data() + at_ - sizeof(value), sizeof(value));
    return value;
  }
  void text() { at_ += number(); }
  /// XCDR2 aligns to at most four bytes.
  void skip(std::size_t size, std::size_t count) {
    if (count == 0) return;
    const std::size_t unit = std::min<std::size_t>(size, 4);
    at_ = (at_ + unit - 1) / unit * unit + size * count;
  }

  std::span<const std::uint8_t> cdr_;
  std::size_t at_ = 0;
};

}  // namespace

bool structsArePresent(std::span<const std::uint8_t> cdr, const std::uint32_t* ops) {
  return Walk(cdr).structure(ops);
}

}  // namespace perdure::wire
