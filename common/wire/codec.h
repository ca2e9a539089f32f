// Domain types ↔ wire types: total (any bytes give a value or a reason) and checked both ways
// against one table of bounds. Reasons: not_finite, out_of_range, over_bound, bad_enum, bad_text,
// size_mismatch, bad_rotation, bad_covariance, bad_probabilities, empty; the detail is the path of
// the field, as "items[3].classes[0].covariance".
#pragma once

#include <memory>
#include <span>

#include "common/base/result.h"
#include "common/wire/arena.h"
#include "common/wire/description/types.h"

namespace perdure::wire {

/// Fills `wire`, which borrows texts and pixels from `value` and sequences from `arena`: it is
/// valid as long as both live and neither changes.
template <class T>
Result<void> encode(const T& value, typename Type<T>::Wire& wire, Arena& arena);

/// Copies everything out of `wire`, which may hold anything that Cyclone delivers.
template <class T>
Result<T> decode(const typename Type<T>::Wire& wire);

/// The same of what lies as CDR in memory that `keeper` keeps (native byte order, no header, as
/// Cyclone hands it over): sequences of bytes stay there. For types that say so below.
template <class T>
Result<T> decodeInPlace(std::span<const std::uint8_t> cdr, std::shared_ptr<const void> keeper);
template <class T>
inline constexpr bool kDecodedInPlace = false;
template <>
inline constexpr bool kDecodedInPlace<Frame> = true;

/// The same without checks, for a dispose: only the key's fields will be read.
template <class T>
void encodeKey(const T& value, typename Type<T>::Wire& wire, Arena& arena);

/// A value of which only the key's fields mean anything: what a dispose carries.
template <class T>
T decodeKey(const typename Type<T>::Wire& wire);

}  // namespace perdure::wire
