#include "tests/common/replay/phone/tiny_gopro.h"

#include <memory>

#include "tests/common/replay/phone/tiny_phones.h"

extern "C" {
#include <libavformat/avformat.h>
}

namespace perdure::replay {
namespace {

constexpr std::size_t kPackets = 4;
constexpr int kUnit = 1000;  // of the track's times: ms

std::string bytesOf(std::int64_t number, std::size_t size) {
  std::string bytes;
  for (std::size_t i = size; i-- > 0;) bytes += static_cast<char>(number >> (8 * i) & 0xff);
  return bytes;
}

/// One sensor's samples of a packet.
std::string stream(const std::string& key, std::size_t packet, std::int64_t per_packet,
                   const TinyGoPro& how, std::int64_t y, std::int64_t z, std::int64_t late_us = 0) {
  const auto first = static_cast<std::int64_t>(packet) * per_packet;
  std::vector<std::int64_t> numbers;
  for (std::int64_t i = first; i < first + per_packet; ++i) {
    numbers.insert(numbers.end(), {i, y, z});
  }
  std::string items;
  constexpr std::int64_t kClock_us = 7'000'000;  // of the camera at the start of the film
  if (how.stamps) {
    items += gpmfNumbers("STMP", 'J',
                         {kClock_us + late_us + 500'000 * static_cast<std::int64_t>(packet)});
  }
  items += gpmfNumbers("TSMP", 'L', {first + per_packet});
  items += gpmfItem("STNM", 'c', 5, 1, "a name");
  items += gpmfNumbers("SCAL", 's', {1000}) + gpmfNumbers(key, 's', numbers, 3);
  return gpmfItem("STRM", '\0', 1, items.size(), items);
}

std::string packetOf(std::size_t packet, const TinyGoPro& how) {
  const std::int64_t z = packet + 1 == kPackets ? how.image_turn : 0;
  const std::string turns =
      gpmfNumbers("SCAL", 's', {32767}) + gpmfNumbers("IORI", 's', {32767, 0, 0, z}, 4);
  const std::string items = stream("GYRO", packet, 100, how, 200, -300) +
                            stream("ACCL", packet, 50, how, 9807, 0, how.accel_late_us) +
                            gpmfItem("STRM", '\0', 1, turns.size(), turns);
  std::string whole = gpmfItem("DEVC", '\0', 1, items.size(), items);
  if (packet == how.damaged) whole.resize(whole.size() / 2);
  return whole;
}

struct Closer {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

void writePackets(AVFormatContext* out, int track, const TinyGoPro& how) {
  const std::unique_ptr<AVPacket, Closer> packet(av_packet_alloc());
  for (std::size_t i = 0; i < kPackets; ++i) {
    if (i == how.lost) continue;
    const std::string bytes = packetOf(i, how);
    av_new_packet(packet.get(), static_cast<int>(bytes.size()));
    std::copy(bytes.begin(), bytes.end(), packet->data);
    const int jitter = i < how.jitter_ms.size() ? how.jitter_ms[i] : 0;
    packet->stream_index = track;
    packet->pts = packet->dts = 500 * static_cast<std::int64_t>(i) + jitter;
    packet->duration = 500;
    av_packet_rescale_ts(packet.get(), AVRational{1, kUnit}, out->streams[track]->time_base);
    av_interleaved_write_frame(out, packet.get());
  }
}

/// Copies the frames of a film into one with a track of telemetry.
void addTelemetry(const std::filesystem::path& from, const std::filesystem::path& to,
                  const TinyGoPro& how) {
  AVFormatContext *opened = nullptr, *out = nullptr;
  avformat_open_input(&opened, from.c_str(), nullptr, nullptr);
  const std::unique_ptr<AVFormatContext, Closer> in(opened);
  avformat_find_stream_info(in.get(), nullptr);
  avformat_alloc_output_context2(&out, nullptr, "mp4", to.c_str());
  AVStream* film = avformat_new_stream(out, nullptr);
  avcodec_parameters_copy(film->codecpar, in->streams[0]->codecpar);
  film->codecpar->codec_tag = 0;  // that of AVI
  AVStream* data = avformat_new_stream(out, nullptr);
  data->codecpar->codec_type = AVMEDIA_TYPE_DATA, data->codecpar->codec_id = AV_CODEC_ID_BIN_DATA;
  data->codecpar->codec_tag = MKTAG('g', 'p', 'm', 'd'), data->time_base = {1, kUnit};
  avio_open(&out->pb, to.c_str(), AVIO_FLAG_WRITE);
  [[maybe_unused]] const int begun = avformat_write_header(out, nullptr);
  const std::unique_ptr<AVPacket, Closer> packet(av_packet_alloc());
  while (av_read_frame(in.get(), packet.get()) >= 0) {
    av_packet_rescale_ts(packet.get(), in->streams[0]->time_base, film->time_base);
    packet->stream_index = 0;
    av_interleaved_write_frame(out, packet.get());
  }
  writePackets(out, 1, how);
  av_write_trailer(out);
  avio_closep(&out->pb);
  avformat_free_context(out);
}

}  // namespace

std::string gpmfItem(const std::string& key, char type, std::size_t size, std::size_t count,
                     const std::string& data) {
  std::string item = key + type + bytesOf(static_cast<std::int64_t>(size), 1) +
                     bytesOf(static_cast<std::int64_t>(count), 2) + data;
  item.resize((item.size() + 3) / 4 * 4);
  return item;
}

std::string gpmfNumbers(const std::string& key, char type, const std::vector<std::int64_t>& numbers,
                        std::size_t n) {
  const std::size_t size = type == 's' ? 2 : type == 'L' ? 4 : 8;
  std::string data;
  for (const std::int64_t number : numbers) data += bytesOf(number, size);
  return gpmfItem(key, type, n * size, numbers.size() / n, data);
}

void writeGoPro(const std::filesystem::path& film, const TinyGoPro& how) {
  const std::filesystem::path frames = film.parent_path() / "frames.avi";
  writeFilm(frames, kFilmFrames, "MJPG");
  addTelemetry(frames, film, how);
  std::filesystem::remove(frames);
}

}  // namespace perdure::replay
