// A drive put down for programs that are not ours: plan.json and images as ROS has them, out of
// which a writer of bags or of MCAP makes a recording; and rosbag2's SQLite, written here.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/replay/dataset.h"

namespace perdure::test {

struct PlanOptions {
  enum class Images { kRaw, kPng };
  Images images = Images::kRaw;
  bool transforms = true;          ///< /tf_static
  bool broken_transforms = false;  ///< of writeDb3: their quaternions are 0, 0, 0, 2
  bool index = true;               ///< of writeDb3, by time
  bool stamps = true;              ///< of headers
  bool one_log_time = false;       ///< of writeDb3: all was recorded at one moment
  /// Of writeDb3: 16 bits a pixel, of which 12 bits are used, and the first so many in the dark.
  std::optional<std::size_t> dark = {};
  std::string suffix = {};  ///< of cam0's name space: "/cam0SUFFIX/image_raw"
};

/// FOLDER/plan.json, of everything that the dataset gives.
std::filesystem::path writePlan(replay::Dataset& dataset, const std::filesystem::path& folder,
                                const PlanOptions& options);
/// By rosbag2's schema (version 3), the messages in CDR.
void writeDb3(replay::Dataset& dataset, const std::filesystem::path& file,
              const PlanOptions& options);
/// The rig file of what ROS does not say: the inertial unit's noise.
std::filesystem::path writeImuRig(const replay::Dataset& dataset,
                                  const std::filesystem::path& file);

/// Kinds, times and indices of all that a dataset gives, and the pixels.
struct Given {
  std::vector<std::string> order;
  std::vector<std::vector<std::uint8_t>> pixels;
};
Given allOf(replay::Dataset& dataset);

}  // namespace perdure::test
