#include "common/vision/film_track.h"

#include <memory>
#include <span>

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/log.h>
}

namespace perdure::vision {
namespace {

struct Closer {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
using OpenedFilm = std::unique_ptr<AVFormatContext, Closer>;
constexpr AVRational kNanosecond{1, 1'000'000'000};

OpenedFilm openFilm(const std::filesystem::path& file) {
  av_log_set_level(AV_LOG_QUIET);
  AVFormatContext* opened = nullptr;
  avformat_open_input(&opened, file.c_str(), nullptr, nullptr);
  return OpenedFilm(opened);
}

/// The track with this code; null if there is none.
const AVStream* trackOf(const AVFormatContext& film, const std::string& code) {
  const std::uint32_t tag = MKTAG(code[0], code[1], code[2], static_cast<unsigned char>(code[3]));
  for (const AVStream* stream : std::span(film.streams, film.nb_streams)) {
    if (stream->codecpar->codec_tag == tag) return stream;
  }
  return nullptr;
}

/// Presentation time of the first frame, in ns.
std::int64_t startOfFrames(AVFormatContext& film) {
  const int track = av_find_best_stream(&film, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (track < 0 || film.streams[track]->start_time == AV_NOPTS_VALUE) return 0;
  return av_rescale_q(film.streams[track]->start_time, film.streams[track]->time_base, kNanosecond);
}

}  // namespace

bool hasFilmTrack(const std::filesystem::path& file, const std::string& code) {
  const OpenedFilm film = openFilm(file);
  return film && trackOf(*film, code) != nullptr;
}

Result<std::vector<FilmPacket>> readFilmTrack(const std::filesystem::path& file,
                                              const std::string& code) {
  const OpenedFilm film = openFilm(file);
  if (!film) {
    return fail("film_unreadable",
                "{} cannot be read as a film: the recording was not finished, or the copy is not "
                "whole; copy it again",
                file.string());
  }
  const AVStream* track = trackOf(*film, code);
  if (track == nullptr) {
    return fail("film_no_track", "{} has no track of data `{}`", file.string(), code);
  }
  const std::int64_t start = startOfFrames(*film);
  std::vector<FilmPacket> packets;
  const std::unique_ptr<AVPacket, Closer> packet(av_packet_alloc());
  while (av_read_frame(film.get(), packet.get()) >= 0) {
    if (packet->stream_index == track->index && packet->pts != AV_NOPTS_VALUE) {
      const std::int64_t time = av_rescale_q(packet->pts, track->time_base, kNanosecond);
      packets.push_back(
          {Duration(time - start),
           {reinterpret_cast<const char*>(packet->data), static_cast<std::size_t>(packet->size)}});
    }
    av_packet_unref(packet.get());
  }
  return packets;
}

}  // namespace perdure::vision
