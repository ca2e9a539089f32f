#include "services/inference/node.h"

#include <algorithm>
#include <opencv2/core/utility.hpp>

#include "common/base/errors.h"
#include "services/inference/core/image_fit.h"
#include "services/inference/core/suppress.h"

namespace perdure::inference {
namespace {

Network loadNetwork(const Config& config, const ModelFile& file) {
  auto network = Network::load(file.network, file.darknet_weights, tensorNames(file.description));
  if (network) return std::move(*network);
  const bool tensor = network.error().code == "model_without_tensor";
  throw StartupError(
      ExitCode::kConfiguration,
      config.model.path +
          (tensor ? " does not fit its description: "
                  : " is not a network that OpenCV can load: ") +
          network.error().detail +
          (tensor ? "; correct the names in its model.json."
                  : "; give a whole .onnx file (opset 11 or so) or a Darknet .cfg with its "
                    ".weights."));
}

/// A grey ramp: nothing is in it, and no value is special.
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

}  // namespace

Node::Node(const Config& config, InstanceId instance)
    : Node(config, instance,
           readModelFile(config.model.path, config.model.description, standardModelFolders())) {}

Node::Node(const Config& config, InstanceId instance, ModelFile file)
    : config_(config), description_(file.description), network_(loadNetwork(config, file)) {
  cv::setNumThreads(static_cast<int>(config.model.threads));
  options_.score_threshold = config.detection.score_threshold;
  info_.instance = instance;
  info_.name = description_.name;
  info_.input_width = static_cast<std::uint32_t>(description_.input.width);
  info_.input_height = static_cast<std::uint32_t>(description_.input.height);
  info_.box_sigma = description_.box_sigma;
  chooseClasses();
  if (!description_.side_insets.empty()) {
    for (const std::string& name : info_.classes) {
      const auto it = description_.side_insets.find(name);
      const auto sides =
          it == description_.side_insets.end() ? std::array<double, 4>{} : it->second;
      info_.side_insets.insert(info_.side_insets.end(), sides.begin(), sides.end());
    }
  }
  std::string identity = toHex(file.hash);
  for (const std::string& name : info_.classes) identity += "\n" + name;
  info_.hash = digest(identity);
  testItself();
}

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
  for (int round = 0; round < 2; ++round) {  // the first one allocates
    if (const auto result = candidatesIn(image); !result) {
      throw StartupError(
          ExitCode::kConfiguration,
          config_.model.path + " fails its test at the start: " + result.error().detail + " (" +
              result.error().code + "); correct its model.json or give another network.");
    }
  }
}

Result<std::vector<Candidate>> Node::candidatesIn(const Frame& frame) {
  const auto blob = makeBlob(description_.input, frame);
  if (!blob) return tl::unexpected(blob.error());
  const auto tensors = network_.forward(*blob);
  if (!tensors) return tl::unexpected(tensors.error());
  auto candidates = decode(description_, options_, *tensors);
  if (!candidates) return candidates;
  std::erase_if(*candidates, [](const Candidate& c) {
    return c.box.width() < 1.0 || c.box.height() < 1.0;  // less than a pixel of input
  });
  return suppress(std::move(*candidates), config_.detection.merge_iou,
                  static_cast<std::size_t>(config_.detection.limit));
}

Result<Detections> Node::infer(const Frame& frame) {
  auto candidates = candidatesIn(frame);
  if (!candidates) return tl::unexpected(candidates.error());
  const ImageFit fit =
      fitOf(description_.input, static_cast<int>(frame.width), static_cast<int>(frame.height));
  Detections out;
  out.stamp = frame.stamp;
  out.camera = frame.camera;
  out.instance = info_.instance;
  out.model_hash = info_.hash;
  for (Candidate& candidate : *candidates) {
    Detection detection;
    detection.box = fit.toImage(candidate.box);
    detection.side_sigma = fit.toImage(candidate.side_sigma);
    detection.activations = std::move(candidate.activations);
    detection.azimuth = candidate.azimuth;
    detection.azimuth_sigma = candidate.azimuth_sigma;
    out.detections.push_back(std::move(detection));
  }
  return out;
}

}  // namespace perdure::inference
