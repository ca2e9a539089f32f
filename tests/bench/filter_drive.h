// The drive of filter_bench. A camera drives through a field of chairs, people and cars. The
// network misses one detection in ten and reports false boxes. The poses drift, and their
// covariances state it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "services/semantic_filter/node.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter::bench {

/// Random objects on both sides of the trajectory, with a given mean number in view.
class Field {
 public:
  Field(std::size_t in_view, std::uint32_t seed);
  /// Returns the objects within visibility of `x`; adds new objects ahead.
  const std::deque<testing::TrueObject>& near(double x);

 private:
  void plant();

  std::mt19937 random_;
  double density_, planted_ = 4.0;
  std::deque<testing::TrueObject> things_;
};

struct Sample {
  double cpu_ms = 0.0;
  std::uint64_t allocations = 0;
  std::size_t in_view = 0, objects = 0, boxes = 0;
};

class Drive {
 public:
  Drive(const Config& config, std::size_t in_view, std::uint32_t seed);
  /// Processes frame k. Frames must come in order, from 0.
  Sample frame(std::uint64_t k);

 private:
  void count(const Objects& message);
  Detections look(std::uint64_t k, const RigidTransform& T_WB);

  Field field_;
  std::mt19937 random_;
  CameraCalibration camera_;
  CameraModel model_;
  std::size_t objects_ = 0, in_view_ = 0;  ///< counts of the newest message
  Node node_;
};

}  // namespace perdure::semantic_filter::bench
