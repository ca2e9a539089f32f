// Relative poses between anchors of one graph.
#pragma once

#include <memory>
#include <optional>

#include "common/mapping/graph/marginals.h"

namespace perdure::mapping {

/// Factorises the graph whenever `from` changes. Requests with the same `from` should be
/// consecutive.
class Relations {
 public:
  explicit Relations(const PoseGraph& graph) : graph_(graph) {}

  /// The pose of `to` relative to `from`. Returns nothing if the graph does not connect the two
  /// anchors.
  std::optional<LevelGaussian> between(AnchorId from, AnchorId to) {
    if (from == to) return LevelGaussian();
    if (from != from_) {
      marginals_ = std::make_unique<Marginals>(graph_, from);
      from_ = from;
    }
    return marginals_->to(to);
  }

 private:
  const PoseGraph& graph_;
  AnchorId from_ = 0;
  std::unique_ptr<Marginals> marginals_;
};

}  // namespace perdure::mapping
