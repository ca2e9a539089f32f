#include "common/wire/codec.h"

#include "common/wire/decoder.h"
#include "common/wire/encoder.h"
#include "common/wire/frame_in_place.h"

namespace perdure::wire {

template <class T>
Result<void> encode(const T& value, typename Type<T>::Wire& wire, Arena& arena) {
  arena.clear();
  wire = {};
  Encoder encoder(arena);
  describe(encoder, value, wire);
  if (encoder.failed()) return tl::unexpected(encoder.reason());
  return {};
}

template <class T>
void encodeKey(const T& value, typename Type<T>::Wire& wire, Arena& arena) {
  arena.clear();
  wire = {};
  Encoder encoder(arena);
  describe(encoder, value, wire);
}

template <class T>
Result<T> decode(const typename Type<T>::Wire& wire) {
  Decoder decoder;
  T value;
  describe(decoder, value, wire);
  if (decoder.failed()) return tl::unexpected(decoder.reason());
  return value;
}

template <>
Result<Frame> decodeInPlace(std::span<const std::uint8_t> cdr, std::shared_ptr<const void> keeper) {
  perdure_msg_Frame wire{};
  if (!frameInPlace(cdr, wire)) return fail("cut_off", "the message");
  Decoder decoder(std::move(keeper));
  Frame value;
  describe(decoder, value, wire);
  if (decoder.failed()) return tl::unexpected(decoder.reason());
  return value;
}

template <class T>
T decodeKey(const typename Type<T>::Wire& wire) {
  Decoder decoder;
  T value;
  describe(decoder, value, wire);
  return value;
}

template <class T>
struct Instances {
  static constexpr auto kEncode = &encode<T>;
  static constexpr auto kEncodeKey = &encodeKey<T>;
  static constexpr auto kDecode = &decode<T>;
  static constexpr auto kDecodeKey = &decodeKey<T>;
};
template struct Instances<Frame>;
template struct Instances<ImuSample>;
template struct Instances<SpeedSample>;
template struct Instances<Calibration>;
template struct Instances<Odometry>;
template struct Instances<Landmarks>;
template struct Instances<Detections>;
template struct Instances<ModelInfo>;
template struct Instances<SwapNotice>;
template struct Instances<Objects>;
template struct Instances<ObjectState>;
template struct Instances<MapNear>;
template struct Instances<Event>;
template struct Instances<Predictions>;
template struct Instances<MapTile>;
template struct Instances<MapHeader>;
template struct Instances<MapFrame>;
template struct Instances<MapQuery>;
template struct Instances<MapReply>;
template struct Instances<Health>;

}  // namespace perdure::wire
