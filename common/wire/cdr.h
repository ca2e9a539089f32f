// Messages as bytes, on the network and in recordings: four bytes of encapsulation (RTPS 2.5,
// 10.5), then XCDR1 (final types) or delimited XCDR2 (appendable ones). Readers whose type has more
// or fewer members can also read delimited XCDR2. This code needs no DDS participant and no
// network.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/wire/codec.h"

namespace perdure::wire {

/// Owns the generated C struct decoded from bytes.
class CdrSample {
 public:
  /// Decodes arbitrary bytes, and reads nothing outside them. Fails with bad_encapsulation or
  /// malformed_cdr.
  static Result<CdrSample> read(std::span<const std::uint8_t> message,
                                const dds_topic_descriptor_t& type);
  const void* get() const { return sample_.get(); }

 private:
  struct Free {
    const dds_topic_descriptor_t* type;
    void operator()(void* sample) const;
  };
  explicit CdrSample(std::unique_ptr<void, Free> sample) : sample_(std::move(sample)) {}
  std::unique_ptr<void, Free> sample_;
};

/// Returns a C struct as bytes, in the wire format of its type.
std::vector<std::uint8_t> writeCdr(const void* sample, const dds_topic_descriptor_t& type);
/// Returns the message of an image without its encapsulation; empty if decodeInPlace() cannot read
/// the encapsulation.
std::span<const std::uint8_t> payloadInPlace(std::span<const std::uint8_t> message);

/// Decodes a value with all checks, or returns the reason of a failure. `keeper` owns the memory of
/// `message`, which the pixels refer to.
template <class T>
Result<T> decodeCdr(std::span<const std::uint8_t> message, std::shared_ptr<const void> keeper) {
  if constexpr (kDecodedInPlace<T>) {
    const auto payload = payloadInPlace(message);
    if (payload.empty()) return fail("bad_encapsulation", "an image that is not XCDR1");
    return decodeInPlace<T>(payload, std::move(keeper));
  } else {
    const auto sample = CdrSample::read(message, Type<T>::descriptor());
    if (!sample) return tl::unexpected(sample.error());
    return decode<T>(*static_cast<const typename Type<T>::Wire*>(sample->get()));
  }
}

template <class T>
Result<std::vector<std::uint8_t>> encodeCdr(const T& value) {
  Arena arena;
  typename Type<T>::Wire sample;
  if (auto encoded = encode(value, sample, arena); !encoded) {
    return tl::unexpected(encoded.error());
  }
  return writeCdr(&sample, Type<T>::descriptor());
}

/// Returns the IDL of a type such as "perdure::msg::Objects" with all types that it needs, as one
/// text without #include. Returns "" for unknown types.
std::string idlOf(std::string_view type_name);

/// Returns the variant of a type such as "perdure::msg::Objects" in which every struct is final;
/// the memory layout is the same. Returns nullptr if the type itself is final, or is unknown.
const dds_topic_descriptor_t* plainTwinOf(const std::string& type_name);

}  // namespace perdure::wire
