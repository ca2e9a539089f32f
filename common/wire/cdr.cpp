#include "common/wire/cdr.h"

#include <dds/ddsc/dds_opcodes.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_sertype.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

namespace perdure::wire {
namespace {

constexpr std::size_t kHeader = 4;
constexpr std::uint8_t kXcdr1 = 0x00, kXcdr2 = 0x06, kDelimitedXcdr2 = 0x08;  // + 1: little-endian
constexpr std::uint32_t kVersion1 = 1, kVersion2 = 2;                         // as in Cyclone
constexpr std::uint8_t kNative = std::endian::native == std::endian::little ? 1 : 0;

bool isFinal(const dds_topic_descriptor_t& type) {
  ddsi_sertype_extensibility kind{};
  return dds_stream_extensibility(type.m_ops, &kind) && kind == DDSI_SERTYPE_EXT_FINAL;
}

/// Returns the XCDR version of an encapsulation; 0 if the encapsulation is not valid for the type.
std::uint32_t versionOf(std::uint8_t encapsulation, const dds_topic_descriptor_t& type) {
  const auto form = static_cast<std::uint8_t>(encapsulation & ~1u);
  if (!isFinal(type)) return form == kDelimitedXcdr2 ? kVersion2 : 0;
  return form == kXcdr1 ? kVersion1 : form == kXcdr2 ? kVersion2 : 0;
}

using Op = std::uint32_t;

/// Returns the size of a number of this kind in bytes, or nothing for kinds that are not numbers.
std::optional<std::size_t> sizeOf(dds_stream_typecode kind) {
  if (kind == DDS_OP_VAL_BLN) return 1;
  if (kind < DDS_OP_VAL_1BY || kind > DDS_OP_VAL_8BY) return std::nullopt;
  return std::size_t{1} << (kind - DDS_OP_VAL_1BY);
}

/// Walks through a message by Cyclone's operations, as Cyclone does, but reads only the lengths.
/// The functions return the next operation, or nullptr if an operation is unknown.
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
    if (!size) number();  // skips the size of all elements in bytes
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

  /// Skips a member that the message does not contain. Returns nullptr if Cyclone would abort.
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
  /// Skips `count` numbers of `size` bytes. XCDR2 aligns to at most four bytes.
  void skip(std::size_t size, std::size_t count) {
    if (count == 0) return;
    const std::size_t unit = std::min<std::size_t>(size, 4);
    at_ = (at_ + unit - 1) / unit * unit + size * count;
  }

  std::span<const std::uint8_t> cdr_;
  std::size_t at_ = 0;
};

/// Cyclone 0.10.2 aborts if an @appendable struct ends before a member that is itself one
/// (cyclonedds#1560, fixed in later versions). Returns whether the message contains all such
/// members. `cdr` is XCDR2 without encapsulation that dds_stream_normalize_data() has accepted;
/// `ops` describe its type. Also returns false if a member is of a kind that Perdure's types do not
/// use.
bool structsArePresent(std::span<const std::uint8_t> cdr, const std::uint32_t* ops) {
  return Walk(cdr).structure(ops);
}

}  // namespace

void CdrSample::Free::operator()(void* sample) const {
  dds_stream_free_sample(sample, type->m_ops);
  dds_free(sample);
}

Result<CdrSample> CdrSample::read(std::span<const std::uint8_t> message,
                                  const dds_topic_descriptor_t& type) {
  const std::uint32_t version =
      message.size() < kHeader || message[0] != 0 ? 0 : versionOf(message[1], type);
  if (version == 0) {
    return fail("bad_encapsulation", std::string("not how ") + type.m_typename + " is encoded");
  }
  // Cyclone checks and byte-swaps in place, and requires aligned memory. In XCDR2 it checks only
  // for four bytes per array element, even if an element has eight. Byte-swapping may therefore
  // access up to twice the size of the data.
  const auto payload = message.subspan(kHeader);
  std::vector<std::uint64_t> aligned(2 * payload.size() / sizeof(std::uint64_t) + 1);
  if (!payload.empty()) std::memcpy(aligned.data(), payload.data(), payload.size());
  auto* const bytes = reinterpret_cast<char*>(aligned.data());
  const auto size = static_cast<std::uint32_t>(payload.size());
  std::uint32_t offset = 0;
  const bool turned = (message[1] & 1u) != kNative;
  if (payload.size() > UINT32_MAX / 2 ||
      !dds_stream_normalize_data(bytes, &offset, size, turned, version, type.m_ops) ||
      offset > size) {
    return fail("malformed_cdr", std::string("no ") + type.m_typename);
  }
  if (version == kVersion2 &&
      !structsArePresent({reinterpret_cast<const std::uint8_t*>(bytes), size}, type.m_ops)) {
    return fail("malformed_cdr", std::string(type.m_typename) + " that lacks a struct");
  }
  std::unique_ptr<void, Free> sample(dds_alloc(type.m_size), Free{&type});
  std::memset(sample.get(), 0, type.m_size);  // otherwise Cyclone would free the old pointers
  dds_istream_t stream;
  dds_istream_init(&stream, size, bytes, version);
  dds_stream_read(&stream, static_cast<char*>(sample.get()), type.m_ops);
  return CdrSample(std::move(sample));
}

std::vector<std::uint8_t> writeCdr(const void* sample, const dds_topic_descriptor_t& type) {
  const bool final = isFinal(type);
  const std::uint8_t form = final ? kXcdr1 : kDelimitedXcdr2;
  dds_ostream_t stream;
  dds_ostream_init(&stream, 0, final ? kVersion1 : kVersion2);
  dds_stream_write(&stream, static_cast<const char*>(sample), type.m_ops);
  std::vector<std::uint8_t> message{0, static_cast<std::uint8_t>(form | kNative), 0, 0};
  message.insert(message.end(), stream.m_buffer, stream.m_buffer + stream.m_index);
  dds_ostream_fini(&stream);
  return message;
}

std::span<const std::uint8_t> payloadInPlace(std::span<const std::uint8_t> message) {
  const bool plain =
      message.size() > kHeader && message[0] == 0 && message[1] == (kXcdr1 | kNative);
  return plain ? message.subspan(kHeader) : std::span<const std::uint8_t>();
}

const dds_topic_descriptor_t* plainTwinOf(const std::string& type_name) {
  const dds_topic_descriptor_t* found = nullptr;
  forEachTopic([&](const auto& row) {
    if (row.descriptor().m_typename == type_name) found = row.twin();
  });
  return found;
}

}  // namespace perdure::wire
