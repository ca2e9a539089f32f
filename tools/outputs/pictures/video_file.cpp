#include "tools/outputs/pictures/video_file.h"

#include <cstring>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "common/base/check.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

namespace perdure::tools {
namespace {

struct Closer {
  void operator()(AVFormatContext* context) const {
    if (context->pb != nullptr) avio_closep(&context->pb);
    avformat_free_context(context);
  }
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
template <class T>
using Held = std::unique_ptr<T, Closer>;

/// Returns an encoder that is ready to use; null if this machine does not support the codec.
Held<AVCodecContext> openCodec(const AVCodec* codec, const cv::Size& size, double rate_hz,
                               bool wants_header) {
  Held<AVCodecContext> context(codec == nullptr ? nullptr : avcodec_alloc_context3(codec));
  if (!context) return nullptr;
  context->width = size.width;
  context->height = size.height;
  context->pix_fmt = AV_PIX_FMT_YUV420P;
  context->framerate = av_d2q(rate_hz, 60000);
  context->time_base = av_inv_q(context->framerate);
  context->gop_size = 50;
  context->colorspace = AVCOL_SPC_SMPTE170M;  // the colour space of OpenCV's conversion
  context->color_range = AVCOL_RANGE_MPEG;
  context->thread_count = 1;  // makes the bytes the same on every machine
  if (codec->id == AV_CODEC_ID_H264) {
    av_opt_set(context->priv_data, "preset", "superfast", 0);
    av_opt_set(context->priv_data, "crf", "24", 0);
  } else {
    context->flags |= AV_CODEC_FLAG_QSCALE;
    context->global_quality = 5 * FF_QP2LAMBDA;
  }
  if (wants_header) context->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  return avcodec_open2(context.get(), codec, nullptr) < 0 ? nullptr : std::move(context);
}

}  // namespace

struct VideoFile::Film {
  std::string codec_name;
  Held<AVFormatContext> file;
  Held<AVCodecContext> codec;
  Held<AVFrame> frame;
  Held<AVPacket> packet;
  AVStream* stream = nullptr;
  std::size_t frames = 0;
  bool begun = false;

  ~Film() { (void)end(); }

  /// Writes the remaining data; further calls do nothing. Returns false if the file is incomplete.
  bool end() {
    if (!std::exchange(begun, false)) return true;
    avcodec_send_frame(codec.get(), nullptr);
    const bool drained = drain();
    const bool ended = av_write_trailer(file.get()) >= 0;
    avio_flush(file->pb);
    return drained && ended && file->pb->error >= 0;
  }

  bool drain() {
    while (avcodec_receive_packet(codec.get(), packet.get()) >= 0) {
      packet->duration = 1;
      av_packet_rescale_ts(packet.get(), codec->time_base, stream->time_base);
      packet->stream_index = stream->index;
      if (av_interleaved_write_frame(file.get(), packet.get()) < 0) return false;
    }
    return true;
  }

  bool begin(const std::filesystem::path& path) {
    stream = avformat_new_stream(file.get(), nullptr);
    if (stream == nullptr || avcodec_parameters_from_context(stream->codecpar, codec.get()) < 0)
      return false;
    stream->time_base = codec->time_base;
    stream->avg_frame_rate = codec->framerate;
    if (avio_open(&file->pb, path.c_str(), AVIO_FLAG_WRITE) < 0) return false;
    begun = avformat_write_header(file.get(), nullptr) >= 0;
    return begun;
  }

  bool makeFrame() {
    frame->format = codec->pix_fmt;
    frame->width = codec->width;
    frame->height = codec->height;
    return av_frame_get_buffer(frame.get(), 0) >= 0;
  }

  /// Copies the planes of a picture, which OpenCV stores in sequence without gaps.
  void fill(const cv::Mat& planes) {
    const std::uint8_t* from = planes.data;
    for (int plane = 0; plane < 3; ++plane) {
      const int width = plane == 0 ? codec->width : codec->width / 2;
      const int height = plane == 0 ? codec->height : codec->height / 2;
      for (int row = 0; row < height; ++row, from += width) {
        std::memcpy(frame->data[plane] + static_cast<std::ptrdiff_t>(row) * frame->linesize[plane],
                    from, static_cast<std::size_t>(width));
      }
    }
  }
};

VideoFile::VideoFile(std::unique_ptr<Film> film) : film_(std::move(film)) {}
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;
VideoFile::~VideoFile() = default;

std::size_t VideoFile::frames() const { return film_->frames; }
const std::string& VideoFile::codec() const { return film_->codec_name; }

Result<VideoFile> VideoFile::open(const std::filesystem::path& file, const cv::Size& size,
                                  double rate_hz) {
  check(size.width > 0 && size.height > 0 && size.width % 2 == 0 && size.height % 2 == 0,
        "the sides of a film are even");
  check(rate_hz > 0.0, "a film has a rate");
  av_log_set_level(AV_LOG_ERROR);
  auto film = std::make_unique<Film>();
  AVFormatContext* format = nullptr;
  avformat_alloc_output_context2(&format, nullptr, "mp4", file.c_str());
  film->file.reset(format);
  film->frame.reset(av_frame_alloc());
  film->packet.reset(av_packet_alloc());
  if (!film->file || !film->frame || !film->packet) return fail("video_no_codec");
  const bool wants_header = (format->oformat->flags & AVFMT_GLOBALHEADER) != 0;
  for (const auto& [name, codec] : {std::pair{"H.264", avcodec_find_encoder_by_name("libx264")},
                                    {"H.264", avcodec_find_encoder_by_name("libopenh264")},
                                    {"MPEG-4", avcodec_find_encoder(AV_CODEC_ID_MPEG4)}}) {
    film->codec_name = name;
    film->codec = openCodec(codec, size, rate_hz, wants_header);
    if (film->codec) break;
  }
  if (!film->codec || !film->makeFrame()) {
    return fail("video_no_codec", "libavcodec has no encoder for H.264 or MPEG-4");
  }
  if (!film->begin(file)) return fail("video_not_written", file.string() + " cannot be written");
  return VideoFile(std::move(film));
}

Result<void> VideoFile::finish() {
  return film_->end() ? Result<void>() : fail("video_not_written", "the disk is full");
}

Result<void> VideoFile::write(const cv::Mat& picture) {
  Film& film = *film_;
  check(picture.type() == CV_8UC3 && picture.cols == film.codec->width &&
            picture.rows == film.codec->height,
        "a picture has the film's size");
  cv::Mat planes;
  cv::cvtColor(picture, planes, cv::COLOR_BGR2YUV_I420);
  if (av_frame_make_writable(film.frame.get()) < 0) return fail("video_not_written");
  film.fill(planes);
  film.frame->pts = static_cast<std::int64_t>(film.frames);
  if (avcodec_send_frame(film.codec.get(), film.frame.get()) < 0 || !film.drain()) {
    return fail("video_not_written", "the disk is full");
  }
  ++film.frames;
  return {};
}

}  // namespace perdure::tools
