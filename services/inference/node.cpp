#include "services/inference/node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "services/inference/core/decode/suppress.h"
#include "services/inference/core/network/image_fit.h"

namespace perdure::inference {
namespace {

std::unique_ptr<Network> networkOf(const Config& config, const ModelFile& file) {
  auto network =
      loadNetwork({file.network, file.darknet_weights, file.description.for_onnx_runtime},
                  tensorNames(file.description), backendOf(config.model.backend),
                  static_cast<int>(config.model.threads));
  if (network) return std::move(*network);
  const auto& [code, detail] = network.error();
  if (code == "backend_absent" && config.model.backend == "auto") {
    throw StartupError(ExitCode::kConfiguration,
                       config.model.path +
                           " has operators that OpenCV does not have (backend in "
                           "its model.json), and " +
                           detail +
                           ": take another network, or build again where libonnxruntime-dev is "
                           "(Debian 13).");
  }
  if (code == "backend_absent") {
    throw StartupError(ExitCode::kConfiguration,
                       "model.backend is onnxruntime, and " + detail +
                           ": take opencv or auto, or build again where libonnxruntime-dev is.");
  }
  const bool tensor = code == "model_without_tensor";
  throw StartupError(
      ExitCode::kConfiguration,
      config.model.path +
          (tensor ? " does not fit its description: " : " is not a network that can be loaded: ") +
          detail +
          (tensor ? "; correct the names in its model.json."
                  : "; give a whole .onnx file (opset 11 or so) or a Darknet .cfg with its "
                    ".weights."));
}

/// Returns a grey ramp without objects.
Frame testImage(const Input& input) {
  Frame frame;
  frame.width = static_cast<std::uint32_t>(input.width);
  frame.height = static_cast<std::uint32_t>(input.height);
  frame.encoding = ImageEncoding::kBgr8;
  std::vector<std::uint8_t> data(std::size_t{frame.width} * frame.height * 3);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i / 3 % 251);
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(data));
  return frame;
}

Detection inImage(const Candidate& candidate, const ImageFit& fit) {
  Detection detection;
  detection.box = fit.toImage(candidate.box);
  detection.side_sigma = fit.toImage(candidate.side_sigma);
  detection.activations = candidate.activations;
  detection.azimuth = candidate.azimuth;
  detection.azimuth_sigma = candidate.azimuth_sigma;
  return detection;
}

/// Returns the part of a box inside the image; nothing if it is less than a quarter of the box, or
/// too small to detect.
std::optional<Box> partInside(const Box& box, const ImageFit& fit) {
  constexpr double kLeastSide = 3.0, kLeastShare = 0.25;
  const double left = fit.offset_x, top = fit.offset_y;
  const Box part{std::max(box.x1, left), std::max(box.y1, top), std::min(box.x2, left + fit.width),
                 std::min(box.y2, top + fit.height)};
  const bool seen = part.width() >= kLeastSide && part.height() >= kLeastSide;
  return seen && part.area() >= kLeastShare * box.area() ? std::optional(part) : std::nullopt;
}

}  // namespace

Node::Node(const Config& config, InstanceId instance)
    : Node(config, instance,
           readModelFile(config.model.path, config.model.description, standardModelFolders())) {}

Node::Node(const Config& config, InstanceId instance, ModelFile file)
    : config_(config), description_(file.description) {
  sizes_.push_back({description_, networkOf(config, file)});
  cv::setNumThreads(static_cast<int>(config.model.threads));
  options_.score_threshold = config.detection.score_threshold;
  info_.instance = instance;
  info_.box_sigma = description_.box_sigma;
  info_.boxes = description_.boxes;
  chooseClasses();
  identity_ = toHex(file.hash);
  for (const std::string& name : info_.classes) identity_ += "\n" + name;
  describe();
  testItself();
  if (config_.model.budget_ms > 0.0) addSmallerSizes(file);
}

/// Describes the network for the present turn. Sides are named as in the image before the turn.
void Node::describe() {
  const Input& input = description_.input;
  const bool across = quarters_ % 2 == 1;
  info_.name = description_.name;
  if (quarters_ > 0) info_.name += fmt::format(", turned by {}°", 90 * quarters_);
  info_.input_width = static_cast<std::uint32_t>(across ? input.height : input.width);
  info_.input_height = static_cast<std::uint32_t>(across ? input.width : input.height);
  info_.side_insets.clear();
  for (const std::string& name : info_.classes) {
    if (description_.side_insets.empty()) break;
    const auto it = description_.side_insets.find(name);
    const auto sides = it == description_.side_insets.end() ? std::array<double, 4>{} : it->second;
    const auto of_image = turned(sides, 4 - quarters_);
    info_.side_insets.insert(info_.side_insets.end(), of_image.begin(), of_image.end());
  }
  info_.hash = digest(quarters_ == 0 ? identity_ : identity_ + "\n" + info_.name);
}

void Node::onOdometry(const Odometry& odometry) {
  if (odometry.state == OdometryState::kInitialising) return;
  up_B_ = odometry.T_WB.q.conjugate() * odometry.up_W;
}

void Node::turnFor(const Frame& frame) {
  int quarters = quarters_;
  const CameraCalibration* camera = calibration_.camera(frame.camera);
  if (config_.detection.turn != "auto") {
    quarters = std::stoi(config_.detection.turn) / 90;
  } else if (description_.upright && camera && up_B_) {
    quarters = uprightQuarters(camera->T_BC.q.conjugate() * *up_B_, quarters_);
  }
  if (quarters == quarters_) return;
  quarters_ = quarters;
  describe();
}

ImageFit Node::fitTo(const Frame& frame) const {
  return fitOf(at().input, static_cast<int>(frame.width), static_cast<int>(frame.height),
               quarters_);
}

/// Adds smaller sizes that the network accepts. Each has its own network, because OpenCV
/// initialises a network again if its input size changes.
void Node::addSmallerSizes(const ModelFile& file) {
  constexpr int kMultiple = 32;  // sizes are multiples of all strides
  const Input& full = description_.input;
  for (const double scale : {0.85, 0.7, 0.6, 0.5}) {
    Size size{description_, networkOf(config_, file)};
    Input& input = size.description.input;
    const auto rounded = [&](int side) {
      return std::max(kMultiple,
                      static_cast<int>(std::lround(scale * side / kMultiple)) * kMultiple);
    };
    input.width = rounded(full.width), input.height = rounded(full.height);
    const Input& last = sizes_.back().description.input;
    if (input.width * input.height >= last.width * last.height) continue;
    sizes_.push_back(std::move(size));
    size_ = sizes_.size() - 1;
    const Frame image = testImage(input);
    bool works = true;
    // two rounds, because the first one allocates memory
    for (int round = 0; round < 2 && works; ++round) {
      works = candidatesIn(image, options_.score_threshold).has_value();
    }
    size_ = 0;
    if (!works) sizes_.pop_back();
  }
}

std::vector<double> Node::sizeShares() const {
  std::vector<double> shares;
  const auto pixels = [](const Input& input) { return 1.0 * input.width * input.height; };
  for (const Size& size : sizes_) {
    shares.push_back(pixels(size.description.input) / pixels(description_.input));
  }
  return shares;
}

void Node::useSize(std::size_t size) {
  check(size < sizes_.size(), "a size of the network's input that there is");
  size_ = size;
}

std::string Node::backend() const { return sizes_.front().network->backend(); }

double Node::inputScale() const { return 1.0 * at().input.width / description_.input.width; }

void Node::chooseClasses() {
  const auto& known = description_.classes;
  const auto& wanted = config_.detection.classes.empty() ? known : config_.detection.classes;
  for (const std::string& name : wanted) {
    const auto it = std::find(known.begin(), known.end(), name);
    if (it == known.end()) {
      throw StartupError(ExitCode::kConfiguration, "detection.classes: the network " +
                                                       description_.name + " knows no class \"" +
                                                       name + "\"; use names of its model.json.");
    }
    if (std::find(info_.classes.begin(), info_.classes.end(), name) != info_.classes.end())
      continue;
    options_.wanted.push_back(static_cast<std::size_t>(it - known.begin()));
    info_.classes.push_back(name);
  }
}

void Node::testItself() {
  const Frame image = testImage(description_.input);
  for (int round = 0; round < 2; ++round) {  // two rounds, because the first one allocates memory
    if (const auto result = candidatesIn(image, options_.score_threshold); !result) {
      throw StartupError(
          ExitCode::kConfiguration,
          config_.model.path + " fails its test at the start: " + result.error().detail + " (" +
              result.error().code + "); correct its model.json or give another network.");
    }
  }
}

Result<std::vector<Candidate>> Node::candidatesIn(const Frame& frame, double floor) {
  const auto blob = makeBlob(at().input, frame, quarters_);
  if (!blob) return tl::unexpected(blob.error());
  const double begun = clock_s_ ? clock_s_() : 0.0;
  const auto tensors = sizes_[size_].network->forward(*blob);
  forward_s_ = clock_s_ ? clock_s_() - begun : 0.0;
  if (!tensors) return tl::unexpected(tensors.error());
  DecodeOptions options = options_;
  options.score_threshold = floor;
  auto candidates = decode(at(), options, *tensors);
  if (!candidates) return candidates;
  std::erase_if(*candidates, [](const Candidate& c) {
    return c.box.width() < 1.0 || c.box.height() < 1.0;  // smaller than a pixel of the input
  });
  return candidates;
}

bool Node::primes(const Predictions& expected, const Frame& frame) const {
  return config_.detection.prime && description_.calibration.primed.floor > 0.0 &&
         !expected.predictions.empty() && fitsFrame(expected, frame);
}

Result<Detections> Node::infer(const Frame& frame, const Predictions& expected) {
  turnFor(frame);
  const bool priming = primes(expected, frame);
  const double lax = options_.score_threshold;
  auto candidates =
      candidatesIn(frame, priming ? std::min(lax, description_.calibration.primed.floor) : lax);
  if (!candidates) return tl::unexpected(candidates.error());
  std::vector<Candidate> passing;
  if (priming) {
    std::copy_if(candidates->begin(), candidates->end(), std::back_inserter(passing),
                 [&](const Candidate& c) { return c.score >= lax; });
  } else {
    passing = *std::move(candidates);
  }
  const auto reported = suppress(std::move(passing), config_.detection.merge_iou,
                                 static_cast<std::size_t>(config_.detection.limit));
  const ImageFit fit = fitTo(frame);
  Detections out;
  out.stamp = frame.stamp;
  out.camera = frame.camera;
  out.instance = info_.instance;
  out.model_hash = info_.hash;
  out.input_scale = inputScale();
  out.forward_s = forward_s_;
  for (const Candidate& candidate : reported) out.detections.push_back(inImage(candidate, fit));
  if (priming) addPrimed(expected, frame, reported, *candidates, out);
  return out;
}

/// Returns the expectations in the order of the predictions. An expectation has activation 0 if the
/// network cannot report its class.
std::vector<Expectation> Node::expectationsOf(const Predictions& expected,
                                              const Frame& frame) const {
  const ImageFit fit = fitTo(frame);
  const double after = toSeconds(frame.stamp.time - expected.stamp.time);
  std::vector<Expectation> expectations;
  for (const Prediction& prediction : expected.predictions) {
    const auto box = partInside(fit.toInput(movedOn(prediction, after)), fit);
    const auto& names = info_.classes;
    const auto name = std::find(names.begin(), names.end(), prediction.class_name);
    const bool asked = box && name != names.end() && prediction.object_id != 0;
    const auto k = static_cast<std::size_t>(name - names.begin()) + 1;
    expectations.push_back(
        {box.value_or(Box{}), asked ? k : 0, fit.toInput(prediction.side_sigma)});
  }
  return expectations;
}

void Node::addPrimed(const Predictions& expected, const Frame& frame,
                     const std::vector<Candidate>& reported,
                     const std::vector<Candidate>& candidates, Detections& out) const {
  const ImageFit fit = fitTo(frame);
  const auto expectations = expectationsOf(expected, frame);
  for (const PrimedAnswer& answer :
       prime(description_.calibration, expectations, reported, candidates)) {
    const Expectation& expectation = expectations[answer.expectation];
    if (expectation.activation == 0) continue;
    Candidate place;
    place.box = expectation.box;
    if (answer.candidate) place = fused(expectation, candidates[*answer.candidate]);
    Detection detection;
    detection.box = fit.toImage(place.box);
    detection.side_sigma = fit.toImage(place.side_sigma);
    // The evidence is for the object's existence, so all classes have the same value.
    const double nats = primedLogRatio(description_.calibration.primed, answer);
    detection.activations.assign(info_.classes.size() + 1, static_cast<float>(nats));
    detection.activations[0] = 0.0F;
    detection.primed = true;
    detection.primed_for = expected.predictions[answer.expectation].object_id;
    out.detections.push_back(std::move(detection));
  }
}

}  // namespace perdure::inference
