// Writes a drive for foreign programs: plan.json and images in ROS form, from which a writer makes
// a bag or an MCAP file. Writes rosbag2's SQLite directly.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/replay/dataset.h"

namespace perdure::test {

struct PlanOptions {
  enum class Images { kRaw, kPng };
  Images images = Images::kRaw;
  bool transforms = true;          ///< /tf_static
  bool broken_transforms = false;  ///< writeDb3 only: quaternions are 0, 0, 0, 2
  bool index = true;               ///< writeDb3 only: an index by time
  bool stamps = true;              ///< stamps in the headers
  bool one_log_time = false;       ///< writeDb3 only: all messages have the same log time
  /// writeDb3 only: 16 bits per pixel, of which 12 are used; the first `dark` images are dark.
  std::optional<std::size_t> dark = {};
  /// writeDb3 only: messages from this time on have earlier times, as after a clock was set back.
  std::int64_t set_ns = INT64_MAX, set_back_ns = 0;
  std::string suffix = {};  ///< suffix of cam0's namespace: "/cam0SUFFIX/image_raw"
};

/// Writes FOLDER/plan.json with all messages of the dataset.
std::filesystem::path writePlan(replay::Dataset& dataset, const std::filesystem::path& folder,
                                const PlanOptions& options);
/// Writes rosbag2's schema (version 3), with messages in CDR.
void writeDb3(replay::Dataset& dataset, const std::filesystem::path& file,
              const PlanOptions& options);
/// Writes the rig file with the inertial unit's noise, which ROS messages do not contain.
std::filesystem::path writeImuRig(const replay::Dataset& dataset,
                                  const std::filesystem::path& file);

/// Kinds, times and indices of all messages of a dataset, and the pixels.
struct Given {
  std::vector<std::string> order;
  std::vector<std::vector<std::uint8_t>> pixels;
};
Given allOf(replay::Dataset& dataset);

}  // namespace perdure::test
