#include "common/vision/film.h"

#include <algorithm>
#include <cmath>
#include <limits>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/log.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

namespace perdure::vision {
namespace {

struct Freer {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(SwsContext* context) const { sws_freeContext(context); }
};
template <class T>
using Owned = std::unique_ptr<T, Freer>;

std::string errorText(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof text);
  return text;
}

/// The matrix by which players turn the pictures; null if there is none.
const std::int32_t* displayMatrix(const AVStream& stream) {
#if LIBAVCODEC_VERSION_MAJOR >= 61  // of Debian 13
  const AVPacketSideData* data =
      av_packet_side_data_get(stream.codecpar->coded_side_data, stream.codecpar->nb_coded_side_data,
                              AV_PKT_DATA_DISPLAYMATRIX);
  return data == nullptr ? nullptr : reinterpret_cast<const std::int32_t*>(data->data);
#else
  return reinterpret_cast<const std::int32_t*>(
      av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr));
#endif
}

int rotationOf(const AVStream& stream) {
  const std::int32_t* matrix = displayMatrix(stream);
  if (matrix == nullptr) return 0;
  const double counter_clockwise = av_display_rotation_get(matrix);
  if (!std::isfinite(counter_clockwise)) return 0;
  return (360 - static_cast<int>(std::lround(counter_clockwise))) % 360;
}

}  // namespace

struct Film::Decoder {
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
  static constexpr std::size_t kNear = 8;  ///< frames that are decoded rather than skipped

  std::string name;
  Owned<AVFormatContext> file;
  Owned<AVCodecContext> codec;
  Owned<AVFrame> frame{av_frame_alloc()};
  Owned<AVPacket> packet{av_packet_alloc()};
  Owned<SwsContext> scaler;
  AVStream* stream = nullptr;
  std::vector<std::int64_t> stamps;  ///< of all frames, sorted, in units of the stream
  /// Presentation and decoding stamps of the key frames, sorted.
  std::vector<std::pair<std::int64_t, std::int64_t>> keys;
  std::int64_t now = kNone;  ///< stamp of the decoded frame

  static std::int64_t stampOf(const AVPacket& of) {
    return of.pts == AV_NOPTS_VALUE ? of.dts : of.pts;
  }

  /// Opens the file and finds the picture track.
  Result<void> open(const std::filesystem::path& path) {
    name = path.string();
    av_log_set_level(AV_LOG_QUIET);  // damaged frames are counted instead
    AVFormatContext* opened = nullptr;
    int status = avformat_open_input(&opened, path.c_str(), nullptr, nullptr);
    if (status < 0) {
      return fail("film_unreadable",
                  "{} cannot be read as a film ({}): the recording was not finished, or the copy "
                  "is not whole; copy it again",
                  name, errorText(status));
    }
    file.reset(opened);
    avformat_find_stream_info(file.get(), nullptr);
    const AVCodec* decoder = nullptr;
    const int track = av_find_best_stream(file.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &decoder, 0);
    if (track < 0) return fail("film_unreadable", "{} has no picture track", name);
    stream = file->streams[track];
    codec.reset(avcodec_alloc_context3(decoder));
    status = avcodec_parameters_to_context(codec.get(), stream->codecpar);
    if (status >= 0) status = avcodec_open2(codec.get(), decoder, nullptr);
    if (status >= 0) return {};
    return fail("film_codec", "{}: its pictures ({}) cannot be decoded: {}", name,
                avcodec_get_name(stream->codecpar->codec_id), errorText(status));
  }

  /// Reads the next packet of the pictures. Returns false at the end.
  bool nextPacket() {
    while (true) {
      av_packet_unref(packet.get());
      if (av_read_frame(file.get(), packet.get()) < 0) return false;
      if (packet->stream_index == stream->index) return true;
    }
  }

  void listPackets() {
    while (nextPacket()) {
      const std::int64_t stamp = stampOf(*packet);
      if (stamp == AV_NOPTS_VALUE || (packet->flags & AV_PKT_FLAG_DISCARD) != 0) continue;
      stamps.push_back(stamp);
      const bool is_key = (packet->flags & AV_PKT_FLAG_KEY) != 0;
      if (is_key) keys.emplace_back(stamp, packet->dts == AV_NOPTS_VALUE ? stamp : packet->dts);
    }
    std::sort(stamps.begin(), stamps.end());
    stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
    std::sort(keys.begin(), keys.end());
  }

  void rewindTo(std::int64_t stamp) {
    if (av_seek_frame(file.get(), stream->index, stamp, AVSEEK_FLAG_BACKWARD) < 0) {
      av_seek_frame(file.get(), -1, 0, AVSEEK_FLAG_BACKWARD);
    }
    avcodec_flush_buffers(codec.get());
    now = kNone;
  }

  std::size_t indexOf(std::int64_t stamp) const {
    return static_cast<std::size_t>(std::lower_bound(stamps.begin(), stamps.end(), stamp) -
                                    stamps.begin());
  }

  /// Moves to the key frame before `wanted`, unless the frame can be reached by decoding on.
  void approach(std::int64_t wanted) {
    const auto next = std::upper_bound(keys.begin(), keys.end(),
                                       std::pair(wanted, std::numeric_limits<std::int64_t>::max()));
    const auto key =
        next == keys.begin() ? std::pair(stamps.front(), stamps.front()) : *std::prev(next);
    const bool ahead = now != kNone && now < wanted;
    if (ahead && (now >= key.first || indexOf(wanted) - indexOf(now) <= kNear)) return;
    rewindTo(key.second);
    // Some files have a wrong index of key frames; then decoding starts at the first frame.
    if (decodeNext() && now > wanted) rewindTo(stamps.front());
  }

  /// Decodes the next frame. Returns false at the end of the film.
  bool decodeNext() {
    while (true) {
      const int status = avcodec_receive_frame(codec.get(), frame.get());
      if (status >= 0) {
        now = frame->best_effort_timestamp;
        return true;
      }
      if (status != AVERROR(EAGAIN)) return false;
      // A damaged packet gives no frame; the decoder continues with the next one.
      avcodec_send_packet(codec.get(), nextPacket() ? packet.get() : nullptr);
    }
  }

  bool decodeUntil(std::int64_t wanted) {
    if (now == wanted) return true;
    approach(wanted);
    while (now < wanted && decodeNext()) {
    }
    if (now == wanted) return true;
    if (now < wanted) rewindTo(stamps.front());  // the end was reached: start again next time
    return false;
  }

  bool isGrey() const {
    const auto* format = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame->format));
    return format != nullptr && format->nb_components < 3;
  }

  Result<cv::Mat> convert(std::optional<ImageEncoding> encoding) {
    const bool mono = encoding.value_or(isGrey() ? ImageEncoding::kMono8 : ImageEncoding::kBgr8) ==
                      ImageEncoding::kMono8;
    const auto to = mono ? AV_PIX_FMT_GRAY8 : AV_PIX_FMT_BGR24;
    scaler.reset(sws_getCachedContext(scaler.release(), frame->width, frame->height,
                                      static_cast<AVPixelFormat>(frame->format), frame->width,
                                      frame->height, to, SWS_BILINEAR | SWS_ACCURATE_RND, nullptr,
                                      nullptr, nullptr));
    if (!scaler) {
      return fail("image_corrupt", "{}: its pixel format cannot be converted", name);
    }
    cv::Mat image(frame->height, frame->width, mono ? CV_8UC1 : CV_8UC3);
    std::uint8_t* rows[4] = {image.data};
    const int strides[4] = {static_cast<int>(image.step[0])};
    sws_scale(scaler.get(), frame->data, frame->linesize, 0, frame->height, rows, strides);
    return image;
  }
};

Film::Film(std::unique_ptr<Decoder> decoder) : decoder_(std::move(decoder)) {
  decoder_->listPackets();
  rotation_deg_ = rotationOf(*decoder_->stream);
  const AVRational unit = decoder_->stream->time_base;
  for (const std::int64_t stamp : decoder_->stamps) {
    times_.emplace_back(
        av_rescale_q(stamp - decoder_->stamps.front(), unit, AVRational{1, 1'000'000'000}));
  }
}
Film::~Film() = default;

Result<std::unique_ptr<Film>> Film::open(const std::filesystem::path& file) {
  auto decoder = std::make_unique<Decoder>();
  if (const auto opened = decoder->open(file); !opened) return tl::unexpected(opened.error());
  std::unique_ptr<Film> film(new Film(std::move(decoder)));
  if (film->times_.empty()) return fail("film_unreadable", "{} has no frame", file.string());
  return film;
}

cv::Size Film::size() const { return {decoder_->codec->width, decoder_->codec->height}; }

Result<cv::Mat> Film::at(std::size_t index, std::optional<ImageEncoding> encoding) {
  if (!decoder_->decodeUntil(decoder_->stamps.at(index))) {
    return fail("image_corrupt", "{}: frame {} cannot be decoded", decoder_->name, index);
  }
  return decoder_->convert(encoding);
}

}  // namespace perdure::vision
