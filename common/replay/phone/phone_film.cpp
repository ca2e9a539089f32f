// The frames of a phone's recording: a film whose frames are matched with a list of stamps, or
// image files.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "common/base/algorithms/folder.h"
#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/replay/files/stamps.h"
#include "common/replay/files/text_file.h"
#include "common/replay/phone/parts.h"
#include "common/vision/decode.h"
#include "common/vision/film.h"
#include "common/vision/image.h"

namespace perdure::replay::phone {
namespace {

namespace fs = std::filesystem;
using vision::Film;

constexpr std::array kFilmEndings{".mp4", ".mov", ".m4v", ".mkv", ".avi"};

std::shared_ptr<Film> openFilm(const fs::path& file) {
  if (!fs::exists(file)) throwMissing(file, "the film", "copy it beside its list of stamps");
  refuseUnreadable(file);
  auto film = Film::open(file);
  if (!film) throw StartupError(ExitCode::kData, film.error().detail);
  return *std::move(film);
}

Result<Frame> loadFrame(Film& film, std::size_t index, std::optional<ImageEncoding> encoding) {
  const auto image = film.at(index, encoding);
  if (!image) return tl::unexpected(image.error());
  Frame frame;
  const auto set = vision::setPixels(frame, *image);
  if (!set) return tl::unexpected(set.error());
  return frame;
}

/// The median distance of the film's times from the listed ones, apart from their start.
Duration distanceOf(const std::vector<ListedFrame>& frames, const std::vector<Duration>& film) {
  std::vector<Duration> offsets;
  for (const ListedFrame& frame : frames) {
    if (frame.number < film.size()) {
      offsets.push_back(between(frame.time, TimePoint(film[frame.number])));
    }
  }
  const Duration middle = medianOf(offsets);
  for (Duration& offset : offsets) offset = std::chrono::abs(offset - middle);
  return medianOf(std::move(offsets));
}

/// Refuses a film and a list that cannot be of one recording. Recorders begin both together, so
/// that the end of one of them is missing if their lengths differ a little.
void checkLengths(const PhoneCamera& camera, std::size_t in_film, Recording& recording) {
  constexpr std::size_t kMost = 10;  // one frame in this number may be missing
  const std::size_t listed = camera.listed;
  const std::size_t lost = in_film < listed ? listed - in_film : in_film - listed;
  if (lost == 0) return;
  if (kMost * lost > listed) {
    throw StartupError(ExitCode::kData,
                       "{} has {} frames, its list {} stamps: they are not of one recording, or "
                       "one of them was cut; copy both again",
                       camera.film.string(), in_film, listed);
  }
  recording.reasons.add(in_film < listed ? "frame_not_in_film" : "frame_without_stamp", lost);
  recording.notes.push_back(fmt::format(
      "{} has {} frames, its list {} stamps; {} {} at the end are left out", camera.film.string(),
      in_film, listed, lost, in_film < listed ? "stamps" : "frames"));
}

/// Notes that the film was converted or lost frames, if its own times contradict the list.
void checkTimes(const PhoneCamera& camera, const std::vector<Duration>& film,
                Recording& recording) {
  std::vector<Duration> intervals;
  for (std::size_t i = 1; i < film.size(); ++i) intervals.push_back(film[i] - film[i - 1]);
  const Duration apart = distanceOf(camera.frames, film);
  if (apart <= medianOf(std::move(intervals)) / 2) return;
  recording.notes.push_back(
      fmt::format("{}: the times in the film differ from its list of stamps by {:.0f} ms (median), "
                  "and those of the list are taken: the film was converted, or frames were lost "
                  "inside of it",
                  camera.film.string(), 1e3 * toSeconds(apart)));
}

/// The frames as the film has them, from its start.
PhoneCamera listedByFilm(PhoneCamera camera, const std::vector<Duration>& film) {
  for (const Duration time : film) {
    camera.frames.push_back({camera.film_start + time, camera.frames.size()});
  }
  camera.listed = film.size();
  return camera;
}

void addFilm(const PhoneCamera& given, std::size_t index, const std::shared_ptr<Film>& film,
             std::optional<ImageEncoding> encoding, Recording& recording) {
  const auto& times = film->times();
  const PhoneCamera camera = given.frames.empty() ? listedByFilm(given, times) : given;
  checkLengths(camera, times.size(), recording);
  checkTimes(camera, times, recording);
  if (film->rotation_deg() != 0) {
    recording.notes.push_back(
        fmt::format("{} is to be shown turned by {}°; it is read as the sensor gave it, as lens "
                    "and T_BS are the sensor's",
                    camera.film.string(), film->rotation_deg()));
  }
  const std::vector<Recording::FrameFile> first = recording.frames;
  for (const ListedFrame& listed : camera.frames) {
    const std::size_t at = listed.number;
    if (at >= times.size()) continue;
    Recording::FrameFile frame{listed.time, at, index, {}};
    frame.load = [film, at, encoding] { return loadFrame(*film, at, encoding); };
    if (index > 0 && !pairWith(first, frame, recording)) continue;
    recording.frames.push_back(std::move(frame));
  }
  if (index == 0) recording.frame_count = std::min(camera.listed, times.size());
}

void addImages(const PhoneCamera& camera, std::size_t index, Recording& recording) {
  const std::vector<Recording::FrameFile> first = recording.frames;
  for (const ListedFrame& listed : camera.frames) {
    Recording::FrameFile frame{listed.time, listed.number, index, listed.image};
    if (index > 0 && !pairWith(first, frame, recording)) continue;
    recording.frames.push_back(std::move(frame));
  }
  if (index == 0) recording.frame_count = camera.listed;
}

/// Size of the first image that can be decoded.
cv::Size sizeOfImages(const PhoneCamera& camera) {
  std::string why = "the list of frames is empty";
  for (const ListedFrame& frame : camera.frames) {
    const auto image = vision::decodeImageFile(frame.image, std::nullopt);
    if (image) return image->size();
    why = image.error().detail;
  }
  throw StartupError(ExitCode::kData, "none of {} listed images can be read: {}",
                     camera.frames.size(), why);
}

/// Gives the lens the size of the images; phones give a lens for the full size too.
void scaleTo(cv::Size size, const PhoneCamera& camera, CameraCalibration& lens) {
  const auto width = static_cast<std::uint32_t>(size.width),
             height = static_cast<std::uint32_t>(size.height);
  if (lens.width != 0 && lens.width != width) {
    const double scale = static_cast<double>(width) / lens.width;
    if (std::abs(scale * lens.height - height) > 1.0) {
      throw StartupError(ExitCode::kData,
                         "the lens of {} is for images of {}x{}, but they are {}x{}, of another "
                         "shape; calibrate at that size and give the rig file with --rig",
                         camera.film.string(), lens.width, lens.height, width, height);
    }
    lens.fx *= scale, lens.fy *= scale;
    lens.cx = (lens.cx + 0.5) * scale - 0.5, lens.cy = (lens.cy + 0.5) * scale - 0.5;
  }
  lens.width = width, lens.height = height;
}

void noteFocal(const PhoneCamera& camera, Recording& recording) {
  if (camera.focal_px.empty()) return;
  const auto [least, most] = std::minmax_element(camera.focal_px.begin(), camera.focal_px.end());
  recording.notes.push_back(fmt::format(
      "by the phone the focal length of its images is {:.1f} … {:.1f} px; without a pose of the "
      "camera it is not used",
      *least, *most));
}

}  // namespace

bool isFilmName(const fs::path& file) {
  const std::string ending = toLower(file.extension().string());
  return std::find(kFilmEndings.begin(), kFilmEndings.end(), ending) != kFilmEndings.end();
}

fs::path filmNamed(const fs::path& folder, const std::string& stem) {
  const auto found = pathsIn(folder, [&](const fs::path& file) {
    return isFilmName(file) && file.stem().string() == stem;
  });
  return found.empty() ? fs::path() : found.front();
}

fs::path onlyFilm(const fs::path& folder) {
  const auto found = pathsIn(folder, isFilmName);
  return found.size() == 1 ? found.front() : fs::path();
}

CameraCalibration addFrames(const PhoneCamera& camera, std::size_t index,
                            const DatasetOptions& options, Recording& recording) {
  CameraCalibration lens = camera.calibration.value_or(CameraCalibration{});
  lens.name = "cam" + std::to_string(index);
  if (camera.film.empty()) {
    addImages(camera, index, recording);
    scaleTo(sizeOfImages(camera), camera, lens);
  } else {
    const auto film = openFilm(camera.film);
    addFilm(camera, index, film, index == 0 ? options.encoding : options.second_encoding,
            recording);
    scaleTo(film->size(), camera, lens);
  }
  noteFocal(camera, recording);
  lens.rate_hz = rateOf(recording.frames, index);
  return lens;
}

}  // namespace perdure::replay::phone
