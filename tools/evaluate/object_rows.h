// Reads objects_inst.csv and objects_final.csv, and finds the frame of each pose.
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

/// Reads a table of estimates. Throws StartupError(kData) that names each invalid line.
std::vector<EstimateRow> readObjectRows(const std::filesystem::path& file);

/// The body's pose by frame index. A trajectory contains times only; the CSV rows tie times to
/// frames. Without CSV rows, stamps that are multiples of 0.1 s (KITTI tracking) give the frame.
/// Poses between two ties get consecutive frames, or are assigned by time if that is impossible.
/// `used`: the frames of a run that skipped some; poses are then consecutive in these.
std::map<std::uint64_t, RigidTransform> posesByFrame(
    const std::vector<replay::StampedPose>& poses, const std::vector<EstimateRow>& rows,
    const std::optional<std::set<std::uint64_t>>& used = {});

}  // namespace perdure::tools
