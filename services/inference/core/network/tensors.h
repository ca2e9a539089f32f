// Names and shapes of the tensors that are requested from a network.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "services/inference/core/description.h"

namespace perdure::inference {

/// A dense float tensor, last index fastest. It does not own its values.
struct Tensor {
  std::vector<int> shape;
  std::span<const float> values;
};

/// A length in expectedShapes() that the network chooses.
inline constexpr int kAnyLength = -1;

struct LevelTensor {
  const char* key;           ///< key in model.json
  std::string Level::*name;  ///< member with the tensor's name in the network
  int channels;
};
/// Tensors of a level, in the order of tensorNames(). For YOLOv8 and NanoDet, `level.tensor` must
/// be set if the level has it; the numbers of channels also depend on the anchors.
std::vector<LevelTensor> levelTensors(const ModelDescription& model, const Level& level);
/// Names of the tensors to request from the network, in the order of decode()'s argument.
std::vector<std::string> tensorNames(const ModelDescription& model);

/// Columns and rows of a level. Perdure and nanodet may exceed the input: 240 / 32 gives 8.
std::pair<int, int> cellsOf(const ModelDescription& model, const Level& level);

/// Number of score columns: the classes, and the background if present.
std::size_t scoreColumns(const ModelDescription& model);

/// Required shapes, in the order of tensorNames(). YOLOv5 heads may also be (1,A,H,W,5+K).
std::vector<std::vector<int>> expectedShapes(const ModelDescription& model);

/// Fails with "model_output_shape" or "model_output_not_finite".
Result<void> validate(const ModelDescription& model, const std::vector<Tensor>& tensors);

}  // namespace perdure::inference
