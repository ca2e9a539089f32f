#include "services/inference/core/network/tensors.h"

#include <cmath>

namespace perdure::inference {
namespace {

using Shape = std::vector<int>;

std::string textOf(const Shape& shape) {
  std::string text;
  for (const int n : shape) {
    text += (text.empty() ? "" : "x") + (n == kAnyLength ? "N" : std::to_string(n));
  }
  return text.empty() ? "nothing" : text;
}

/// Returns the other layout of a YOLOv5 head, (1,A,H,W,5+K); an empty shape for other networks.
Shape otherLayout(const ModelDescription& model, const Shape& shape) {
  if (model.family != Family::kYolov5 || shape.size() != 4) return {};
  const int row = 5 + static_cast<int>(model.classes.size());
  return {1, shape[1] / row, shape[2], shape[3], row};
}

bool fits(const Shape& shape, const Shape& expected) {
  if (shape.size() != expected.size()) return false;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] != expected[i] && !(expected[i] == kAnyLength && shape[i] > 0)) return false;
  }
  return true;
}

void addWholeShapes(const ModelDescription& model, std::vector<Shape>& shapes) {
  const int classes = static_cast<int>(model.classes.size());
  const int columns = static_cast<int>(scoreColumns(model));
  const bool planes = model.family == Family::kYolov8;
  if (model.outputs.predictions.empty()) {
    for (const int n : {4, columns}) {
      shapes.push_back(planes ? Shape{1, n, kAnyLength} : Shape{1, kAnyLength, n});
    }
  } else if (planes) {
    shapes.push_back({1, 4 + classes, kAnyLength});
  } else if (model.family == Family::kNanoDet) {
    int cells = 0;
    for (const Level& level : model.levels) {
      const auto [width, height] = cellsOf(model, level);
      cells += width * height;
    }
    shapes.push_back({1, cells, classes + 4 * model.bins});
  } else {
    shapes.push_back({1, kAnyLength, 5 + classes});
  }
}

}  // namespace

std::vector<LevelTensor> levelTensors(const ModelDescription& model, const Level& level) {
  const int classes = static_cast<int>(model.classes.size());
  const int anchors = static_cast<int>(level.anchors.size());
  std::vector<LevelTensor> tensors;
  switch (model.family) {
    case Family::kPerdure:
      tensors = {{"box", &Level::box, 4}, {"logits", &Level::logits, 1 + classes}};
      if (model.azimuth.bins > 0)
        tensors.push_back({"azimuth", &Level::azimuth, 2 * model.azimuth.bins});
      if (model.spread_scale > 0) tensors.push_back({"spread", &Level::spread, 4});
      return tensors;
    case Family::kYoloFastest:
    case Family::kYolov5:
      return {{"tensor", &Level::tensor, anchors * (5 + classes)}};
    case Family::kYoloFastestV2:
      return {{"box", &Level::box, 4 * anchors},
              {"objectness", &Level::objectness, anchors},
              {"classes", &Level::classes, classes}};
    case Family::kYolov8:
    case Family::kNanoDet:
      if (!level.tensor.empty()) return {{"tensor", &Level::tensor, 4 * model.bins + classes}};
      return {{"box", &Level::box, 4 * model.bins}, {"classes", &Level::classes, classes}};
    default:
      return {{"box", &Level::box, 4},
              {"objectness", &Level::objectness, 1},
              {"classes", &Level::classes, classes}};
  }
}

std::vector<std::string> tensorNames(const ModelDescription& model) {
  const Outputs& whole = model.outputs;
  if (!whole.predictions.empty()) return {whole.predictions};
  if (!whole.boxes.empty()) return {whole.boxes, whole.scores};
  std::vector<std::string> names;
  for (const Level& level : model.levels) {
    for (const LevelTensor& tensor : levelTensors(model, level)) {
      names.push_back(level.*tensor.name);
    }
  }
  return names;
}

std::pair<int, int> cellsOf(const ModelDescription& model, const Level& level) {
  const bool reaches = model.family == Family::kPerdure || model.family == Family::kNanoDet;
  const int beyond = reaches ? level.stride - 1 : 0;
  return {(model.input.width + beyond) / level.stride,
          (model.input.height + beyond) / level.stride};
}

std::size_t scoreColumns(const ModelDescription& model) {
  return model.classes.size() + (model.background == Background::kNone ? 0 : 1);
}

std::vector<Shape> expectedShapes(const ModelDescription& model) {
  std::vector<Shape> shapes;
  if (model.outputs.any()) {
    addWholeShapes(model, shapes);
  } else {
    for (const Level& level : model.levels) {
      const auto [columns, rows] = cellsOf(model, level);
      for (const auto& [key, name, channels] : levelTensors(model, level)) {
        shapes.push_back(model.family == Family::kYoloFastest ? Shape{1, rows, columns, channels}
                                                              : Shape{1, channels, rows, columns});
      }
    }
  }
  return shapes;
}

Result<void> validate(const ModelDescription& model, const std::vector<Tensor>& tensors) {
  const auto names = tensorNames(model);
  const auto shapes = expectedShapes(model);
  if (tensors.size() != names.size()) return fail("model_output_shape", "tensors are missing");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Shape& shape = tensors[i].shape;
    if (!fits(shape, shapes[i]) && !fits(shape, otherLayout(model, shapes[i]))) {
      return fail("model_output_shape", names[i] + " is " + textOf(shape) + ", not " +
                                            textOf(shapes[i]) + " as model.json says");
    }
    for (const float value : tensors[i].values) {
      if (!std::isfinite(value)) return fail("model_output_not_finite", names[i]);
    }
  }
  return {};
}

}  // namespace perdure::inference
