// The tensors that a network is asked for: their names, and the shapes that they must have.
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

/// Names of the tensors to ask the network for, in the order that decode() takes them.
std::vector<std::string> tensorNames(const ModelDescription& model);

/// Columns and rows of a level's cells. Those of the families perdure and nanodet may reach beyond
/// the input's border: 240 / 32 is 8 rows.
std::pair<int, int> cellsOf(const ModelDescription& model, const Level& level);

/// Columns of the scores: the classes and, where there is one, the background.
std::size_t scoreColumns(const ModelDescription& model);

/// What the tensors must look like, in the order of tensorNames(). The heads of YOLOv5 may also
/// be (1,A,H,W,5+K).
std::vector<std::vector<int>> expectedShapes(const ModelDescription& model);

/// Reasons: "model_output_shape", "model_output_not_finite".
Result<void> validate(const ModelDescription& model, const std::vector<Tensor>& tensors);

}  // namespace perdure::inference
