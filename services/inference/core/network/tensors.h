// Names and shapes of the tensors that are requested from a network.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "services/inference/core/description.h"

namespace perdure::inference {

/// A dense float tensor whose last index is the fastest. It does not own its values.
struct Tensor {
  std::vector<int> shape;
  std::span<const float> values;
};

/// Stands in expectedShapes() for a length that the network chooses.
inline constexpr int kAnyLength = -1;

struct LevelTensor {
  const char* key;           ///< key in model.json
  std::string Level::*name;  ///< member with the tensor's name in the network
  int channels;
};
/// Returns the tensors of a level, in the order of tensorNames(). For YOLOv8 and NanoDet,
/// `level.tensor` must be set if the level has one tensor.
std::vector<LevelTensor> levelTensors(const ModelDescription& model, const Level& level);
/// Returns the names of the tensors to request from the network, in the order of decode()'s
/// argument.
std::vector<std::string> tensorNames(const ModelDescription& model);

/// Returns the columns and rows of a level. The cells of perdure and nanodet may extend beyond the
/// input: 240 / 32 gives 8.
std::pair<int, int> cellsOf(const ModelDescription& model, const Level& level);

/// Returns the number of score columns: the classes, and the background if present.
std::size_t scoreColumns(const ModelDescription& model);

/// Returns the required shapes, in the order of tensorNames(). YOLOv5 heads may also be
/// (1,A,H,W,5+K).
std::vector<std::vector<int>> expectedShapes(const ModelDescription& model);

/// Checks shapes and values. Fails with "model_output_shape" or "model_output_not_finite".
Result<void> validate(const ModelDescription& model, const std::vector<Tensor>& tensors);

}  // namespace perdure::inference
