#include "tools/model/look.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/base/check.h"
#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/files/text_file.h"
#include "common/vision/decode.h"
#include "common/vision/image.h"
#include "services/inference/core/decode/evidence.h"
#include "services/inference/node.h"
#include "tools/outputs/pictures/drawing.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

/// Returns the best class of a detection with the network's own score, which is computed back from
/// the calibrated evidence.
Sight sightOf(const Detection& detection, const ModelInfo& model,
              const inference::Calibration& calibration) {
  const auto& a = detection.activations;
  const auto best = std::max_element(a.begin() + 1, a.end());
  const double log_odds = inference::oddsOf(calibration, *best);
  const auto k = static_cast<std::size_t>(best - a.begin()) - 1;
  return {detection.box, model.classes.at(k), inference::sigmoid(log_odds)};
}

Frame frameOf(const cv::Mat& pixels) {
  Frame frame;
  frame.camera = "cam0";
  check(vision::setPixels(frame, pixels).has_value(), "a picture has pixels of eight bits");
  return frame;
}

}  // namespace

Frame readPicture(const fs::path& file) {
  const auto pixels = vision::decodeImageFile(file.string(), ImageEncoding::kBgr8);
  if (!pixels) {
    throw StartupError(ExitCode::kUnavailable,
                       "the picture " + pixels.error().detail + "; give --image a JPEG or PNG");
  }
  return frameOf(*pixels);
}

Frame greyRamp(int width, int height) {
  cv::Mat pixels(height, width, CV_8UC3);
  for (int x = 0; x < width; ++x) pixels.col(x).setTo(cv::Scalar::all(40 + 170.0 * x / width));
  return frameOf(pixels);
}

Look lookAt(const fs::path& network, const Frame* frame, double threshold) {
  inference::Config config;
  config.model.path = network.string();
  config.detection.score_threshold = threshold;
  inference::Node node(config, 1);
  const auto description =
      inference::readModelFile(network.string(), "", inference::standardModelFolders()).description;
  Look look;
  look.input_width = description.input.width;
  look.input_height = description.input.height;
  const auto answer =
      node.infer(frame != nullptr ? *frame : greyRamp(look.input_width, look.input_height));
  if (!answer) {
    throw StartupError(ExitCode::kConfiguration, "{} fails on the picture: {} ({})",
                       network.string(), answer.error().detail, answer.error().code);
  }
  for (const Detection& detection : answer->detections) {
    look.sights.push_back(sightOf(detection, node.model(), description.calibration));
  }
  // Applies the threshold again, because second detections of an object have lost evidence.
  std::erase_if(look.sights, [&](const Sight& s) { return s.score < threshold; });
  std::ranges::stable_sort(look.sights, std::greater{}, &Sight::score);
  return look;
}

void checkDrawing(const fs::path& file) {
  const std::string kind = replay::toLower(file.extension().string());
  if (kind == ".png" || kind == ".jpg" || kind == ".jpeg") return;
  throw StartupError(ExitCode::kUsage, "--out " + file.string() +
                                           ": a drawing is a .png or a .jpg; give a name that "
                                           "ends so");
}

void drawSights(const Frame& frame, const std::vector<Sight>& sights, const fs::path& file) {
  checkDrawing(file);
  cv::Mat image = vision::viewOf(frame)->clone();
  const cv::Rect all({}, image.size());
  std::vector<cv::Rect> taken;
  for (const Sight& sight : sights) {
    const Box& b = sight.box;
    const Colour colour = classColour(sight.name);
    drawClosed(image, {{b.x1, b.y1}, {b.x2, b.y1}, {b.x2, b.y2}, {b.x1, b.y2}}, {colour, 2});
    const std::string text = fmt::format("{} {:.2f}", sight.name, sight.score);
    const cv::Size size = sizeOf(text) + cv::Size(6, 6);
    const cv::Point at(static_cast<int>(std::clamp(b.x1, 0.0, double(image.cols))),
                       static_cast<int>(std::clamp(b.y1, 0.0, double(image.rows))) - 2);
    const cv::Rect place = placeFor(size, at, all, taken);
    tint(image, place, colour, 0.85);
    drawText(image, text, {place.x + 3, place.y + place.height - 4}, kPaper);
    taken.push_back(place);
  }
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(file.extension().string(), image, bytes)) {
    throwUnwritten(file, "the picture cannot be packed");
  }
  writeChecked(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace perdure::tools
