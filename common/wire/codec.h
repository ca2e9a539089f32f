// Converts between domain types and wire types. Any bytes give a value or a reason; both directions
// check one table of bounds. Reasons: not_finite, out_of_range, over_bound, bad_enum, bad_text,
// size_mismatch, bad_rotation, bad_covariance, bad_probabilities, empty. The detail is the path of
// the field, for example "items[3].classes[0].covariance".
#pragma once

#include <memory>
#include <span>

#include "common/base/result.h"
#include "common/wire/arena.h"
#include "common/wire/topics.h"

namespace perdure::wire {

/// Fills `wire`, which refers to texts and pixels of `value` and to sequences in `arena`. It is
/// valid as long as both exist unchanged. If a field is refused, the key's fields are still set.
template <class T>
Result<void> encode(const T& value, typename Type<T>::Wire& wire, Arena& arena);

/// Copies all values from `wire`, which may contain anything that Cyclone delivers.
template <class T>
Result<T> decode(const typename Type<T>::Wire& wire);

/// Decodes CDR in memory owned by `keeper` (native byte order, no header, as Cyclone delivers it).
/// Byte sequences are not copied. Available for the types listed below.
template <class T>
Result<T> decodeInPlace(std::span<const std::uint8_t> cdr, std::shared_ptr<const void> keeper);
template <class T>
inline constexpr bool kDecodedInPlace = false;
template <>
inline constexpr bool kDecodedInPlace<Frame> = true;

/// Decodes a dispose: a value in which only the key's fields are defined.
template <class T>
T decodeKey(const typename Type<T>::Wire& wire);

}  // namespace perdure::wire
