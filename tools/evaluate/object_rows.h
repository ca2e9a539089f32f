// objects_inst.csv and objects_final.csv read back, and which frame each pose belongs to.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/replay/files/pose_file.h"

namespace perdure::tools {

struct EstimateRow {
  std::uint64_t frame = 0;
  TimePoint time;
  std::uint64_t id = 0;
  std::string class_name;
  double score = 0;
  Eigen::Vector3d centre_W = Eigen::Vector3d::Zero();
  double length = 0, width = 0, height = 0, yaw = 0;
};

/// Throws StartupError(kData) that names each wrong line.
std::vector<EstimateRow> readObjectRows(const std::filesystem::path& file);

/// The body's pose by frame index. A trajectory has times only; the rows of the CSV tie times to
/// frames, stamps that are multiples of 0.1 s from 0 (KITTI tracking) tie themselves, and lines
/// between tied ones are consecutive frames, or where they cannot be, placed by time. `used`: the
/// frames of the run, where it was not over all: consecutive are then those of them.
std::map<std::uint64_t, RigidTransform> posesByFrame(
    const std::vector<replay::StampedPose>& poses, const std::vector<EstimateRow>& rows,
    const std::optional<std::set<std::uint64_t>>& used = {});

}  // namespace perdure::tools
