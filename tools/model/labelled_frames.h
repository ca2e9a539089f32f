// Frames with true boxes, from simulated folders, from KITTI, or from the objects of a run.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/math/rigid_transform.h"
#include "common/replay/dataset.h"
#include "common/replay/files/class_aliases.h"
#include "common/types/detections.h"

namespace perdure::tools {

struct TrueBox {
  Box box;                 ///< complete outline in pixels, clipped to the image
  std::string class_name;  ///< canonical name; empty: an unlabelled region
  bool ignored = false;    ///< counts neither as a miss nor as a false alarm
  /// Box around the image of the object's cuboid; empty if it is unknown or the object is partly
  /// hidden.
  std::optional<Box> hull;
};

struct LabelledFrame {
  std::uint64_t frame = 0;  ///< index in the dataset
  std::vector<TrueBox> boxes;
};

struct LabelRequest {
  std::filesystem::path data;
  std::string sequence;  ///< sequence of KITTI tracking
  /// label_02/SEQUENCE.txt (found automatically in KITTI tracking), or the output folder of a run.
  std::filesystem::path labels;
  std::uint64_t every = 1;  ///< use every N-th frame
};

struct LabelledData {
  std::unique_ptr<replay::Dataset> dataset;
  std::vector<LabelledFrame> frames;  ///< sorted by index
  /// Classes with complete labels; empty: all classes.
  std::set<std::string> judged;
  bool sides_known = true;  ///< false: the sides of a box are predictions, not measured
};

/// Returns the box around the images of a cuboid's corners, not clipped to the image; nothing if a
/// corner cannot be projected.
std::optional<Box> boxAround(const Eigen::Vector3d& centre_W, double yaw,
                             const Eigen::Vector3d& size, const RigidTransform& T_CW,
                             const CameraModel& camera);

/// Reads frames and labels. Objects are `ignored` if their visible share is below a quarter or
/// their longer side below `least_px` pixels of the image; they are omitted if that share is below
/// a twentieth. In KITTI, objects that are largely occluded (2, 3) or truncated and DontCare
/// regions are ignored. Throws StartupError (69) with the missing file and the fix.
LabelledData readLabelled(const LabelRequest& request, const replay::ClassAliases& aliases,
                          double least_px);

/// Reads frames with the objects of a run as labels, for a calibration without manual labels.
///
/// `request.labels` is the output folder of `perdure pipeline` over the same frames. Objects of its
/// final map (objects_final.csv) are expected in each frame in which they are not occluded.
///
/// Boxes of objects that are uncertain, truncated, largely occluded or small are ignored. Boxes
/// beside an object are ignored too, because sizes in the map have errors. Only classes with at
/// least twenty views are `judged`. Boxes of moving objects, and of objects missing from the map,
/// count as clutter.
///
/// Throws StartupError (69) with the fix if there are too few data.
LabelledData readMapLabels(const LabelRequest& request, std::unique_ptr<replay::Dataset> dataset,
                           const replay::ClassAliases& aliases, double least_px);

}  // namespace perdure::tools
