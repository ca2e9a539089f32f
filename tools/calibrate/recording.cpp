#include "tools/calibrate/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>

#include "common/base/errors.h"
#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "common/replay/files/text_file.h"
#include "common/vision/decode.h"
#include "common/vision/image.h"
#include "tools/data_check/data_check.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;
using Progress = std::function<void(std::size_t, std::size_t)>;

constexpr std::size_t kBatch = 16;  ///< images whose corners are detected in parallel

struct Picture {
  std::size_t camera = 0;
  View view;
  cv::Mat grey;
};

class Finder {
 public:
  Finder(const Board& board, CalibrationDrive& drive) : board_(board), drive_(drive) {}

  void add(Picture picture) {
    waiting_.push_back(std::move(picture));
    if (waiting_.size() >= kBatch) flush();
  }
  void flush() {
    cv::parallel_for_(cv::Range(0, static_cast<int>(waiting_.size())), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) {
        auto& picture = waiting_[static_cast<std::size_t>(i)];
        picture.view.corners = findCorners(board_, picture.grey);
      }
    });
    for (Picture& picture : waiting_) {
      CameraViews& camera = drive_.cameras[picture.camera];
      ++camera.images;
      if (!picture.view.corners.empty()) camera.views.push_back(std::move(picture.view));
    }
    waiting_.clear();
  }

 private:
  const Board& board_;
  CalibrationDrive& drive_;
  std::vector<Picture> waiting_;
};

bool isPicture(const fs::path& file) {
  const std::string extension = replay::toLower(file.extension().string());
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg" ||
         extension == ".bmp" || extension == ".pgm" || extension == ".tif";
}

std::vector<fs::path> picturesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && isPicture(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

void readPictures(const std::vector<fs::path>& files, const Board& board,
                  const ReadOptions& options, CalibrationDrive& drive, const Progress& progress) {
  drive.cameras.resize(1);
  CameraCalibration& camera = drive.cameras[0].prior;
  camera.name = "cam0";
  camera.rate_hz = 1.0;
  Finder finder(board, drive);
  for (std::size_t i = 0; i < files.size(); i += options.every) {
    const auto decoded = vision::decodeImageFile(files[i].string(), ImageEncoding::kMono8);
    if (!decoded) {
      drive.problem = decoded.error().detail;
      continue;
    }
    const cv::Mat& grey = *decoded;
    if (camera.width == 0) {
      camera.width = static_cast<std::uint32_t>(grey.cols);
      camera.height = static_cast<std::uint32_t>(grey.rows);
    }
    if (static_cast<std::uint32_t>(grey.cols) != camera.width ||
        static_cast<std::uint32_t>(grey.rows) != camera.height) {
      throw StartupError(ExitCode::kUnavailable,
                         files[i].string() +
                             " is not of the size of the pictures before it; put "
                             "pictures of one camera at one size into the folder");
    }
    finder.add({0, {i, fromNanoseconds(static_cast<std::int64_t>(i) * 1'000'000'000), {}}, grey});
    if (progress) progress(i + 1, files.size());
  }
  finder.flush();
}

void readDataset(const Board& board, const ReadOptions& options, CalibrationDrive& drive,
                 const Progress& progress) {
  replay::DatasetOptions wanted;
  wanted.path = options.data, wanted.sequence = options.sequence, wanted.rig = options.rig;
  wanted.encoding = wanted.second_encoding = ImageEncoding::kMono8;
  wanted.uncalibrated = true;
  const auto dataset = replay::Dataset::open(wanted);
  const auto doubts = replay::checkData(dataset->recording(), {});
  replay::refuseFatal(doubts, options.data.string());
  tools::printDoubts(dataset->recording(), doubts);
  for (const auto& camera : dataset->calibration().cameras)
    drive.cameras.push_back({camera, 0, {}});
  drive.imu = dataset->calibration().imu;
  Finder finder(board, drive);
  while (auto message = dataset->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*message)) {
      drive.samples.push_back(*sample);
      continue;
    }
    const auto* frame = std::get_if<Frame>(&*message);
    if (!frame || !frame->data || frame->stamp.sequence % options.every != 0) continue;
    const auto grey = vision::monoOf(*frame);
    if (!grey) continue;
    std::size_t camera = 0;
    while (drive.cameras[camera].prior.name != frame->camera) ++camera;
    finder.add({camera, {frame->stamp.sequence, frame->stamp.time, {}}, grey->clone()});
    if (progress && camera == 0) progress(frame->stamp.sequence + 1, dataset->frameCount());
  }
  finder.flush();
  for (const auto& [reason, count] : dataset->reasons().all()) {
    drive.problem += fmt::format("{}{}: {}", drive.problem.empty() ? "" : ", ", reason, count);
  }
}

}  // namespace

CalibrationDrive readDrive(const Board& board, const ReadOptions& options,
                           const Progress& progress) {
  CalibrationDrive drive;
  const auto files = picturesIn(options.data);
  if (files.empty()) {
    readDataset(board, options, drive, progress);
  } else {
    readPictures(files, board, options, drive, progress);
  }
  for (const CameraViews& camera : drive.cameras) {
    if (!camera.views.empty()) continue;
    if (camera.images == 0) {
      throw StartupError(ExitCode::kUnavailable,
                         fmt::format("{} has no images of {} that can be read; record them too "
                                     "(perdure record --images){}",
                                     options.data.string(), camera.prior.name,
                                     drive.problem.empty() ? "" : " (" + drive.problem + ")"));
    }
    throw StartupError(
        ExitCode::kUnavailable,
        fmt::format("{}: {} found in none of {} images of {}; compare its numbers with the printed "
                    "board ({}), and look at the images: is it sharp, lit evenly, flat, {}?{}",
                    options.data.string(), board.text(), camera.images, camera.prior.name,
                    board.kind == BoardKind::kChessboard ? "inner corners are counted, not squares"
                                                         : "tags are of family 36h11",
                    board.kind == BoardKind::kChessboard ? "and always whole in the image"
                                                         : "and not too far away",
                    drive.problem.empty() ? "" : " (" + drive.problem + ")"));
  }
  return drive;
}

}  // namespace perdure::calibrate
