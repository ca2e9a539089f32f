// Converts between domain and wire types; both directions check one table of bounds. Reasons:
// not_finite, out_of_range, over_bound, bad_enum, bad_text, size_mismatch, bad_rotation,
// bad_covariance, bad_probabilities, empty. The detail is the path of the field.
#pragma once

#include <memory>
#include <span>

#include "common/base/result.h"
#include "common/wire/arena.h"
#include "common/wire/topics.h"

namespace perdure::wire {

/// Fills `wire`, which refers to `value` and `arena`. If a field is refused, the key is still set.
template <class T>
Result<void> encode(const T& value, typename Type<T>::Wire& wire, Arena& arena);

/// Copies all values from `wire`, which may contain anything that Cyclone delivers.
template <class T>
Result<T> decode(const typename Type<T>::Wire& wire);

/// Decodes CDR in memory owned by `keeper` (native byte order, no header) without copying bytes.
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
