// Targets: bus messages, recordings of them, and compressed images.
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "common/replay/dataset.h"
#include "common/replay/recordings/mcap_reader.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "common/vision/decode.h"
#include "common/vision/jpeg.h"
#include "common/wire/cdr.h"
#include "common/wire/json.h"
#include "tests/common/wire/examples.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace perdure::fuzz {
namespace {

namespace fs = std::filesystem;

struct WireType {
  std::string name;
  bool (*take)(View);
  Bytes (*example)(unsigned seed);
};

/// Decodes a message; an accepted one must be valid enough to be sent and shown.
template <class T>
bool takeMessage(View bytes) {
  // A separate buffer with the alignment that DDS gives.
  const auto keeper = std::make_shared<Bytes>(bytes.begin(), bytes.end());
  const auto value = wire::decodeCdr<T>(*keeper, keeper);
  if (!value) {
    require(!value.error().code.empty(), "a refusal has a reason");
    return false;
  }
  const auto again = wire::encodeCdr(*value);
  require(again.has_value(), "what was taken can be sent");
  const auto copy = std::make_shared<Bytes>(*again);
  require(wire::decodeCdr<T>(*copy, copy).has_value(), "what was sent is taken");
  require(!wire::toJson(*value).dump().empty(), "what was taken can be shown");
  return true;
}

template <class T>
Bytes exampleOf(unsigned seed) {
  T message;
  wire::Examples(seed).fill(message);
  return wire::encodeCdr(message).value();
}

const std::vector<WireType>& allTypes() {
  static const auto types = [] {
    std::vector<WireType> all;
    wire::forEachTopic([&]<class Row>(const Row& row) {
      using T = typename Row::Message;
      all.push_back({row.descriptor().m_typename, takeMessage<T>, exampleOf<T>});
    });
    return all;
  }();
  return types;
}

/// The first byte selects the type.
bool takeWire(View bytes) {
  if (bytes.empty()) return false;
  return allTypes()[bytes[0] % allTypes().size()].take(bytes.subspan(1));
}

std::vector<Bytes> wireSeeds() {
  std::vector<Bytes> seeds;
  for (std::size_t i = 0; i < allTypes().size(); ++i) {
    for (const unsigned seed : {1U, 2U, 3U}) {
      Bytes bytes = allTypes()[i].example(seed);
      bytes.insert(bytes.begin(), static_cast<std::uint8_t>(i));
      seeds.push_back(std::move(bytes));
    }
  }
  return seeds;
}

Bytes contentsOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A recording of two of each sensor message, odometry and a calibration, in two chunks.
Bytes recording(bool finished) {
  const fs::path file = scratch() / "seed.mcap";
  fs::remove(file);
  replay::RecordingWriter writer(file);
  wire::Examples examples(7);
  Calibration calibration;
  Frame frame;
  Odometry odometry;
  examples.fill(calibration), examples.fill(frame), examples.fill(odometry);
  (void)writer.add("calibration", calibration, 1000);
  for (std::uint64_t i = 1; i <= 4; ++i) {
    ImuSample imu;
    examples.fill(imu);
    imu.time = fromNanoseconds(static_cast<std::int64_t>(5'000'000 * i));
    (void)writer.add("imu", imu, 1000 + i);
    (void)writer.add("frame/cam0", frame, 1000 + i);
    (void)writer.add("odometry", odometry, 1000 + i);
    if (i == 2) (void)writer.cut();
  }
  if (finished) (void)writer.finish();
  if (!finished) (void)writer.cut();
  return contentsOf(file);
}

template <class T>
void putChannel(Bytes& file, std::uint16_t id, const std::string& topic) {
  replay::mcap::putRecord(
      file, replay::mcap::Schema{id, wire::Type<T>::descriptor().m_typename, "omgidl", ""});
  replay::mcap::putRecord(file, replay::mcap::Channel{id, id, topic, "cdr", {}});
}
template <class T>
void putAlone(Bytes& file, std::uint16_t channel, const T& message, std::uint64_t log_ns) {
  const Bytes data = wire::encodeCdr(message).value();
  replay::mcap::putMessage(file, {channel, 1, log_ns, log_ns, data});
}

/// A recording without chunks, as small writers store it. Without `ended`, the end records are
/// missing.
Bytes withoutChunks(bool ended) {
  Bytes file(replay::mcap::kMagic.begin(), replay::mcap::kMagic.end());
  putChannel<Calibration>(file, 1, "perdure/ego/calibration");
  putChannel<ImuSample>(file, 2, "perdure/ego/imu");
  putChannel<Frame>(file, 3, "perdure/ego/frame/cam0");
  wire::Examples examples(7);
  Calibration calibration;
  Frame frame;
  examples.fill(calibration), examples.fill(frame);
  putAlone(file, 1, calibration, 1000);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    ImuSample imu;
    examples.fill(imu);
    imu.time = fromNanoseconds(static_cast<std::int64_t>(5'000'000 * i));
    putAlone(file, 2, imu, 1000 + i);
    putAlone(file, 3, frame, 1000 + i);
  }
  if (!ended) return file;
  replay::mcap::Put put(file);
  put.record(replay::mcap::Op::kDataEnd, Bytes(4));
  put.record(replay::mcap::Op::kFooter, Bytes(replay::mcap::kFooterContent));
  file.insert(file.end(), replay::mcap::kMagic.begin(), replay::mcap::kMagic.end());
  return file;
}

/// The records of withoutChunks() in one chunk, by LZ4, or by zstd without its content size.
Bytes packedByOthers(const std::string& compression) {
  const Bytes records = withoutChunks(false);
  const View content = View(records).subspan(replay::mcap::kMagic.size());
  Bytes packed(LZ4F_compressFrameBound(content.size(), nullptr) +
               ZSTD_compressBound(content.size()));
  if (compression == "lz4") {
    packed.resize(
        LZ4F_compressFrame(packed.data(), packed.size(), content.data(), content.size(), nullptr));
  } else {
    ZSTD_CCtx* context = ZSTD_createCCtx();
    ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
    packed.resize(
        ZSTD_compress2(context, packed.data(), packed.size(), content.data(), content.size()));
    ZSTD_freeCCtx(context);
  }
  Bytes file(replay::mcap::kMagic.begin(), replay::mcap::kMagic.end()), chunk;
  replay::mcap::Put put(chunk);
  put(std::uint64_t{1000});
  put(std::uint64_t{1003});
  put(std::uint64_t{content.size()});
  put(std::uint32_t{0});
  put(compression);
  put(std::uint64_t{packed.size()});
  put.bytes(packed);
  replay::mcap::Put(file).record(replay::mcap::Op::kChunk, chunk);
  return file;
}

/// Reads every chunk and message, then finishes the file and opens it again.
bool readContainer(const fs::path& file) {
  auto reader = replay::mcap::Reader::open(file);
  if (!reader) return false;
  std::uint64_t messages = 0;
  for (const auto& chunk : reader->chunks()) {
    const auto records = reader->unpack(chunk);
    if (!records) continue;
    replay::mcap::Catalogue found;
    replay::mcap::forEachMessage(
        **records, [&](const auto& message, std::uint64_t) { messages += 1 + message.data.size(); },
        found);
  }
  if (reader->finish()) require(replay::mcap::Reader::open(file).has_value(), "finished is read");
  return messages > 0;
}

bool takeContainer(View bytes) { return readContainer(asFile("run.mcap", bytes)); }

/// Reads the file as a dataset, and message by message.
bool takeRecording(View bytes) {
  const fs::path file = asFile("drive.mcap", bytes);
  const bool messages = unlessRefused([&] {
    replay::RecordedMessages recorded(file);
    recorded.rewind();
    std::uint64_t last = 0;
    while (const auto message = recorded.next()) {
      require(message->log_ns >= last, "log times do not go back");
      last = message->log_ns;
      (void)replay::valueOf<Frame>(*message);
      (void)replay::valueOf<Calibration>(*message);
    }
  });
  const bool drive = unlessRefused([&] {
    const auto dataset = replay::Dataset::open({.path = file});
    while (dataset->next()) {
    }
  });
  return messages && drive;
}

bool takeRecords(View bytes) {
  replay::mcap::Catalogue found;
  return replay::mcap::forEachMessage(
      bytes, [](const auto&, std::uint64_t) {}, found);
}

std::vector<Bytes> recordSeeds() {
  replay::mcap::Draft draft;
  const Bytes data(40, 7);
  draft.add({1, 1, 1000, 1007, data});
  draft.add({2, 2, 1001, 1008, data});
  Bytes records = draft.records();
  const auto put = [&](replay::mcap::Op op, const Bytes& content) {
    replay::mcap::Put(records).record(op, content);
  };
  Bytes schema, channel;
  replay::mcap::putRecord(schema,
                          replay::mcap::Schema{1, "perdure::msg::Imu", "omgidl", "struct Imu {};"});
  replay::mcap::putRecord(
      channel, replay::mcap::Channel{1, 1, "perdure/ego/imu", "cdr", {{"key", "value"}}});
  put(replay::mcap::Op::kSchema, schema);
  put(replay::mcap::Op::kChannel, channel);
  return {records};
}

Frame ramp() {
  Frame frame;
  frame.width = 24, frame.height = 16;
  auto pixels = std::make_shared<Bytes>(std::size_t{24} * 16);
  for (std::size_t i = 0; i < pixels->size(); ++i) (*pixels)[i] = static_cast<std::uint8_t>(3 * i);
  frame.data = pixels;
  return frame;
}

/// A frame of 24 × 16 pixels with the bytes as its JPEG.
bool takeJpeg(View bytes) {
  Frame frame = ramp();
  frame.encoding = ImageEncoding::kJpegMono8;
  frame.data = std::make_shared<Bytes>(bytes.begin(), bytes.end());
  const auto grey = vision::decompressed(frame, ImageEncoding::kMono8);
  const auto colour = vision::decompressed(frame, ImageEncoding::kBgr8);
  require(!grey || grey->data->size() == 24 * 16, "a frame has its pixels");
  require(!colour || colour->data->size() == 3 * 24 * 16, "a frame has its pixels");
  return grey && colour;
}

std::vector<Bytes> jpegs() {
  const auto packed = vision::compressed(ramp(), 80).value();
  return {Bytes(packed.data->begin(), packed.data->end())};
}

}  // namespace

std::vector<Target> binaryTargets() {
  const auto recordings = [] {
    return std::vector<Bytes>{recording(true),      recording(false),      withoutChunks(true),
                              withoutChunks(false), packedByOthers("lz4"), packedByOthers("zstd")};
  };
  return {{"wire", 48000, wireSeeds, takeWire},
          {"mcap", 9000, recordings, takeContainer},
          {"recording", 4200, recordings, takeRecording},
          {"mcap_records", 18000, recordSeeds, takeRecords},
          {"jpeg", 9000, jpegs, takeJpeg}};
}

}  // namespace perdure::fuzz
