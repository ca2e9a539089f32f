// Converts between domain types and wire types. Every input gives a value or a reason. Both
// directions check the same table of bounds. Reasons: not_finite, out_of_range, over_bound,
// bad_enum, bad_text, size_mismatch, bad_rotation, bad_covariance, bad_probabilities, empty. The
// detail is the path of the field, for example "items[3].classes[0].covariance".
#pragma once

#include <memory>
#include <span>

#include "common/base/result.h"
#include "common/wire/arena.h"
#include "common/wire/topics.h"

namespace perdure::wire {

/// Fills `wire`, which then refers to texts and pixels of `value` and to sequences in `arena`.
/// `wire` is valid while both exist unchanged. If a field is refused, the fields of the key are
/// still set.
template <class T>
Result<void> encode(const T& value, typename Type<T>::Wire& wire, Arena& arena);

/// Copies all values from `wire`, which may contain anything that Cyclone delivers.
template <class T>
Result<T> decode(const typename Type<T>::Wire& wire);

/// Decodes CDR in memory owned by `keeper` (native byte order, no header, as Cyclone delivers it)
/// without copying byte sequences. Available for the types of kDecodedInPlace.
template <class T>
Result<T> decodeInPlace(std::span<const std::uint8_t> cdr, std::shared_ptr<const void> keeper);
template <class T>
inline constexpr bool kDecodedInPlace = false;
template <>
inline constexpr bool kDecodedInPlace<Frame> = true;

/// Decodes a disposal. In the result only the fields of the key are defined.
template <class T>
T decodeKey(const typename Type<T>::Wire& wire);

}  // namespace perdure::wire
