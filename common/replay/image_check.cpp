#include "common/replay/image_check.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "common/base/files/access.h"
#include "common/replay/files/image_folder.h"
#include "common/vision/decode.h"
#include "common/vision/image.h"
#include "common/vision/jpeg.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ImageGrade = DataFinding::Grade;
using FileList = std::vector<const Recording::FrameFile*>;

/// A camera's image files, classified without reading them.
struct Listed {
  std::size_t all = 0, missing = 0, denied = 0;
  std::string why_denied = {};  ///< of the first denied file
  FileList empty, whole;        ///< sorted by time; images of a recording count as whole
};

Listed listedOf(const Recording& recording, std::size_t camera) {
  Listed listed;
  for (const auto& frame : recording.frames) {
    if (frame.camera != camera || (!frame.load && frame.path.empty())) continue;
    ++listed.all;
    std::error_code error;
    const auto size = frame.load ? 1 : fs::file_size(frame.path, error);
    if (!frame.load && !error && access(frame.path.c_str(), R_OK) != 0 && listed.denied++ == 0)
      listed.why_denied = perdure::whyUnreadable(frame.path);
    if (error) {
      ++listed.missing;
    } else {
      (size == 0 ? listed.empty : listed.whole).push_back(&frame);
    }
  }
  return listed;
}

/// The first, middle and last file, and `more` files from a fixed random sequence.
FileList someOf(const FileList& all, std::size_t more) {
  if (all.empty()) return {};
  const std::size_t last = all.size() - 1;
  std::set<std::size_t> places{0, all.size() / 2, last};
  std::mt19937_64 chance(1);
  for (std::size_t i = 0; i < more && !all.front()->load; ++i) places.insert(chance() % all.size());
  FileList some;
  for (const std::size_t place : places) some.push_back(all[place]);
  return some;
}

std::string nameIn(const Recording::FrameFile& file) {
  return file.path.empty() ? fmt::format("frame {}", file.index)
                           : fs::path(file.path).filename().string();
}

/// Explains why a file is missing.
std::string whyMissing(const Recording::FrameFile& file) {
  std::error_code error;
  if (!fs::is_symlink(file.path, error)) return file.path + " is not there";
  return file.path + " is a link to " + fs::read_symlink(file.path, error).string() +
         ", which is not there";
}

std::string whyUnreadable(const Recording::FrameFile& file, const std::string& detail) {
  const std::string ending = fs::path(file.path).extension().string();
  const bool unknown = !file.path.empty() && !isImageName(file.path);
  return unknown ? fmt::format("{} ({} is not read; convert the images to PNG or JPEG)", detail,
                               ending.empty() ? "a name without ending" : ending)
                 : detail;
}

/// Returns the grade if a camera has no image: fatal for cam0; without cam1 a run continues with
/// cam0.
ImageGrade gradeOfNone(std::size_t camera) {
  return camera == 0 ? ImageGrade::kFatal : ImageGrade::kWarning;
}

void addNone(const Recording& recording, std::size_t camera, const std::string& what,
             DataFindings& findings) {
  findings.push_back(
      {gradeOfNone(camera), "image_unreadable",
       fmt::format("no image of {} {}", recording.calibration.cameras[camera].name, what)});
}

/// Adds findings about missing and empty files. Returns false if no image is left to check.
bool checkFiles(const Recording& recording, std::size_t camera, const Listed& listed,
                DataFindings& findings) {
  const auto& name = recording.calibration.cameras[camera].name;
  if (listed.whole.empty()) {
    const auto& frames = recording.frames;
    const auto first = std::find_if(frames.begin(), frames.end(), [&](const auto& frame) {
      return frame.camera == camera && !frame.path.empty();
    });
    addNone(recording, camera,
            fmt::format("can be read: of {} files {} are empty and {} not there; {}; copy or fetch "
                        "the drive again",
                        listed.all, listed.empty.size(), listed.missing,
                        listed.empty.empty() ? whyMissing(*first)
                                             : listed.empty.front()->path + " has 0 bytes"),
            findings);
    return false;
  }
  constexpr double kMostLost =
      0.1;  // largest accepted share of empty files; the same as for missing files
  const auto empty = static_cast<double>(listed.empty.size());
  if (empty > kMostLost * static_cast<double>(listed.all)) {
    findings.push_back(
        {ImageGrade::kWarning, "images_empty",
         fmt::format("{} of the {} images of {} ({:.0f} %) are empty files (0 bytes), the first of "
                     "them {}: fetch or copy the drive again",
                     listed.empty.size(), listed.all, name,
                     100.0 * empty / static_cast<double>(listed.all),
                     nameIn(*listed.empty.front()))});
  }
  return true;
}

bool isFlat(const cv::Mat& image) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0] < 1.5;
}

/// Results of the images that were read.
struct Looked {
  std::size_t tried = 0, unreadable = 0, other_size = 0, flat = 0;
  std::string size, first_unreadable, why;
  const Recording::FrameFile *right = nullptr, *other = nullptr;  ///< first ones of either size
};

Looked lookAt(const FileList& some, const CameraCalibration& calibration) {
  constexpr std::uint32_t kColumns = 340;
  const int factor = reductionFor(calibration, kColumns);
  Looked looked;
  looked.tried = some.size();
  for (const auto* file : some) {
    const auto image = monoImageOf(*file, factor);
    if (!image) {
      if (looked.unreadable++ > 0) continue;
      looked.first_unreadable = nameIn(*file);
      looked.why = whyUnreadable(*file, image.error().detail);
      continue;
    }
    if (!isOfCamera(*image, factor, calibration)) {
      ++looked.other_size;
      const auto whole = monoImageOf(*file);
      if (whole) looked.size = fmt::format("{}x{}", whole->cols, whole->rows);
      if (looked.other == nullptr) looked.other = file;
    } else if (looked.right == nullptr) {
      looked.right = file;
    }
    looked.flat += isFlat(*image) ? 1 : 0;
  }
  return looked;
}

/// Correlation of the grey values of two images of the same size.
double correlationOf(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat result;
  cv::matchTemplate(a, b, result, cv::TM_CCOEFF_NORMED);
  return result.at<float>(0, 0);
}

/// Adds images_inverted if the middle image is the negative of both neighbours.
void checkInverted(const FileList& all, const CameraCalibration& calibration,
                   DataFindings& findings) {
  constexpr std::uint32_t kColumns = 160;
  constexpr double kClearly = 0.5;
  if (all.size() < 3 || all.front()->load) return;
  std::vector<cv::Mat> images;
  for (std::size_t i = all.size() / 2 - 1; images.size() < 3; ++i) {
    const auto image = monoImageOf(*all[i], reductionFor(calibration, kColumns));
    if (!image || (!images.empty() && image->size() != images.front().size())) return;
    images.push_back(*image);
  }
  if (correlationOf(images[0], images[1]) > -kClearly ||
      correlationOf(images[1], images[2]) > -kClearly ||
      correlationOf(images[0], images[2]) < kClearly)
    return;
  findings.push_back({ImageGrade::kCause, "images_inverted",
                      fmt::format("image {} of {} is the negative of the one before and of the one "
                                  "after it: invert the grey values of every second image (255 - "
                                  "value)",
                                  nameIn(*all[all.size() / 2]), calibration.name)});
}

/// Adds images_change_size: finds the first image whose size differs from its predecessor's.
void addChangeOfSize(const FileList& all, const Looked& looked,
                     const CameraCalibration& calibration, DataFindings& findings) {
  constexpr std::uint32_t kColumns = 340;
  const int factor = reductionFor(calibration, kColumns);
  const auto isRight = [&](const Recording::FrameFile* file) {
    const auto image = monoImageOf(*file, factor);
    return image && isOfCamera(*image, factor, calibration);
  };
  const bool before = looked.right->time < looked.other->time;
  if (isRight(all.front()) != before || isRight(all.back()) == before) return;  // several changes
  const auto from = std::ranges::find(all, before ? looked.right : looked.other),
             to = std::ranges::find(all, before ? looked.other : looked.right);
  const auto changed =
      std::partition_point(from, to, [&](const auto* file) { return isRight(file) == before; });
  const std::string own = fmt::format("{}x{}", calibration.width, calibration.height);
  findings.push_back(
      {ImageGrade::kWarning, "images_change_size",
       fmt::format("the images of {} change from {} to {} at frame {} of {} ({}, {} ns); {} of {} "
                   "that were tried are {}, which cannot be used: cut the drive there, or scale "
                   "these images",
                   calibration.name, before ? own : looked.size, before ? looked.size : own,
                   changed - all.begin(), all.size(), nameIn(**changed),
                   toNanoseconds((*changed)->time), looked.other_size, looked.tried, looked.size)});
}

}  // namespace

void checkImages(const Recording& recording, std::size_t camera, DataFindings& findings) {
  const CameraCalibration& calibration = recording.calibration.cameras[camera];
  const Listed listed = listedOf(recording, camera);
  if (listed.all == 0 || !checkFiles(recording, camera, listed, findings)) return;
  if (!listed.why_denied.empty()) {
    findings.push_back({ImageGrade::kWarning, "images_denied",
                        fmt::format("{} of {} images of {} may not be read: {}", listed.denied,
                                    listed.all, calibration.name, listed.why_denied)});
  }
  Looked looked = lookAt(someOf(listed.whole, 9), calibration);
  // Check more images, because the first ones may not be representative.
  if (looked.unreadable == looked.tried) looked = lookAt(someOf(listed.whole, 60), calibration);
  if (looked.unreadable == looked.tried) {
    return addNone(recording, camera,
                   fmt::format("that was tried ({}) can be read: {}", looked.tried, looked.why),
                   findings);
  }
  if (looked.unreadable > 1) {
    findings.push_back(
        {ImageGrade::kWarning, "images_unreadable",
         fmt::format("{} of {} images of {} that were tried cannot be read, the first of them {}: "
                     "{}; fetch or copy the drive again",
                     looked.unreadable, looked.tried, calibration.name, looked.first_unreadable,
                     looked.why)});
  }
  if (looked.other_size > 0 && looked.other_size + looked.unreadable == looked.tried) {
    findings.push_back(
        {ImageGrade::kFatal, "image_size",
         fmt::format(
             "the images of {} are {}, its calibration is for {}x{}: set `resolution` (width, "
             "height) where it was only written wrongly, or calibrate at the images' size",
             calibration.name, looked.size, calibration.width, calibration.height)});
  } else if (looked.right != nullptr && looked.other_size > 1) {
    addChangeOfSize(listed.whole, looked, calibration, findings);
  } else if (looked.flat == looked.tried) {
    findings.push_back(
        {ImageGrade::kWarning, "image_flat",
         fmt::format("the images of {} are of one grey: see exposure, lens cap and bit depth",
                     calibration.name)});
  }
  checkInverted(listed.whole, calibration, findings);
}

Result<cv::Mat> monoImageOf(const Recording::FrameFile& file, int reduce) {
  if (!file.load) {
    return vision::decodeImageFile(file.path, ImageEncoding::kMono8, vision::usedBits(file.path),
                                   reduce);
  }
  const auto loaded = file.load();
  if (!loaded) return tl::unexpected(loaded.error());
  const auto frame = vision::decompressed(*loaded);
  if (!frame) return tl::unexpected(frame.error());
  auto image = vision::monoOf(*frame);
  if (!image) return image;
  cv::Mat copy;
  cv::resize(*image, copy, {image->cols / reduce, image->rows / reduce}, 0, 0, cv::INTER_AREA);
  return copy;
}

int reductionFor(const CameraCalibration& camera, std::uint32_t columns) {
  int factor = 1;
  while (factor < 8) {
    const auto next = static_cast<std::uint32_t>(2 * factor);
    if (camera.width / next < columns || camera.height / next < columns / 2) break;
    factor *= 2;
  }
  return factor;
}

bool isOfCamera(const cv::Mat& reduced, int factor, const CameraCalibration& camera) {
  const auto isOf = [&](int px, std::uint32_t of_camera) {
    return std::abs(px * factor - static_cast<int>(of_camera)) < factor;
  };
  return isOf(reduced.cols, camera.width) && isOf(reduced.rows, camera.height);
}

}  // namespace perdure::replay
