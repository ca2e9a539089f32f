// A tiny drive as a folder and as a ROS recording.
#pragma once

#include <filesystem>
#include <string>

#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/interop/ros/drive_plan.h"

namespace perdure::test {

/// The folder, the .db3 file, and the rig file with the noise of its inertial unit.
struct Twin {
  std::filesystem::path folder, file, rig;
};

inline Twin twinOf(const std::string& name, const PlanOptions& options = {}, bool stereo = false) {
  Twin twin{replay::tinyEuroc(name + "_source", stereo), replay::freshFolder(name) / "run_0.db3",
            replay::freshFolder(name + "_rig") / "rig.yaml"};
  const auto dataset = replay::Dataset::open({.path = twin.folder});
  writeDb3(*dataset, twin.file, options);
  writeImuRig(*dataset, twin.rig);
  return twin;
}

}  // namespace perdure::test
