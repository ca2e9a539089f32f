#include "common/wire/codec.h"

#include "common/wire/coder.h"
#include "common/wire/frame_in_place.h"

namespace perdure::wire {
namespace {

template <class T>
Result<T> decoded(const typename Type<T>::Wire& wire, std::shared_ptr<const void> keeper) {
  Coder<false> decoder(std::move(keeper));
  T value;
  describe(decoder, value, wire);
  if (decoder.failed()) return tl::unexpected(decoder.reason());
  return value;
}

}  // namespace

template <class T>
Result<void> encode(const T& value, typename Type<T>::Wire& wire, Arena& arena) {
  arena.clear();
  wire = {};
  Coder<true> encoder(arena);
  describe(encoder, value, wire);
  if (encoder.failed()) return tl::unexpected(encoder.reason());
  return {};
}

template <class T>
Result<T> decode(const typename Type<T>::Wire& wire) {
  return decoded<T>(wire, {});
}

template <>
Result<Frame> decodeInPlace(std::span<const std::uint8_t> cdr, std::shared_ptr<const void> keeper) {
  perdure_msg_Frame wire{};
  if (!frameInPlace(cdr, wire)) return fail("cut_off", "the message");
  return decoded<Frame>(wire, std::move(keeper));
}

template <class T>
T decodeKey(const typename Type<T>::Wire& wire) {
  Coder<false> decoder({});
  T value;
  describe(decoder, value, wire);
  return value;
}

template <class Rows>
struct Instances;
template <class... Rows>
struct Instances<std::tuple<Rows...>> {
  static constexpr std::tuple kEncode{&encode<typename Rows::Message>...};
  static constexpr std::tuple kDecode{&decode<typename Rows::Message>...};
  static constexpr std::tuple kDecodeKey{&decodeKey<typename Rows::Message>...};
};
template struct Instances<Topics>;

}  // namespace perdure::wire
