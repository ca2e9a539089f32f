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

bool isAnchored(Family family) {
  return family == Family::kYoloFastest || family == Family::kYolov5;
}

bool hasDistances(Family family) { return family == Family::kYolov8 || family == Family::kNanoDet; }

/// The other layout of a YOLOv5 head, (1,A,H,W,5+K); empty for all other networks.
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

void addLevelShapes(const ModelDescription& model, const Level& level, std::vector<Shape>& shapes) {
  const int classes = static_cast<int>(model.classes.size());
  const auto [columns, rows] = cellsOf(model, level);
  const auto plane = [&, columns = columns, rows = rows](int channels) {
    shapes.push_back({1, channels, rows, columns});
  };
  const int anchored = static_cast<int>(level.anchors.size()) * (5 + classes);
  switch (model.family) {
    case Family::kPerdure:
      plane(4);
      plane(1 + classes);
      if (model.azimuth.bins > 0) plane(2 * model.azimuth.bins);
      if (model.spread_scale > 0) plane(4);
      break;
    case Family::kYoloFastest:
      shapes.push_back({1, rows, columns, anchored});
      break;
    case Family::kYolov5:
      plane(anchored);
      break;
    case Family::kYoloFastestV2:
      plane(4 * static_cast<int>(level.anchors.size()));
      plane(static_cast<int>(level.anchors.size()));
      plane(classes);
      break;
    case Family::kYolov8:
    case Family::kNanoDet:
      if (level.tensor.empty()) {
        plane(4 * model.bins);
        plane(classes);
      } else {
        plane(4 * model.bins + classes);
      }
      break;
    default:
      for (const int channels : {4, 1, classes}) plane(channels);
  }
}

}  // namespace

std::vector<std::string> tensorNames(const ModelDescription& model) {
  const Outputs& whole = model.outputs;
  if (!whole.predictions.empty()) return {whole.predictions};
  if (!whole.boxes.empty()) return {whole.boxes, whole.scores};
  std::vector<std::string> names;
  for (const Level& level : model.levels) {
    if (isAnchored(model.family) || (hasDistances(model.family) && !level.tensor.empty())) {
      names.push_back(level.tensor);
    } else if (model.family == Family::kPerdure) {
      names.insert(names.end(), {level.box, level.logits});
      if (model.azimuth.bins > 0) names.push_back(level.azimuth);
      if (model.spread_scale > 0) names.push_back(level.spread);
    } else if (hasDistances(model.family)) {
      names.insert(names.end(), {level.box, level.classes});
    } else {
      names.insert(names.end(), {level.box, level.objectness, level.classes});
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
    for (const Level& level : model.levels) addLevelShapes(model, level, shapes);
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
