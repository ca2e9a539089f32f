// Frames with true boxes, for calibration: simulated folders, KITTI with its labels, and any frames
// with the objects of a run over them (map_labels.h).
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
  Box box;                  ///< whole outline, pixels of the image, cut at its border
  std::string class_name;   ///< canonical; empty: of no class, a region where nobody labelled
  bool ignored = false;     ///< neither to be found nor wrong to be found
  std::optional<Box> hull;  ///< of its cuboid's image, where it is wholly seen and known
};

struct LabelledFrame {
  std::uint64_t frame = 0;  ///< index in the dataset
  std::vector<TrueBox> boxes;
};

struct LabelRequest {
  std::filesystem::path data;
  std::string sequence;  ///< of KITTI tracking
  /// label_02/SEQUENCE.txt, which is found by itself in KITTI tracking; or OUT of a run.
  std::filesystem::path labels;
  std::uint64_t every = 1;  ///< each so many frames
};

struct LabelledData {
  std::unique_ptr<replay::Dataset> dataset;
  std::vector<LabelledFrame> frames;  ///< in order
  /// Classes whose every instance is labelled; empty: of all things.
  std::set<std::string> judged;
  bool sides_known = true;  ///< the sides of a box are those of the image, not a prediction
};

/// Box around the images of a cuboid's corners, not cut at the border; nothing where a corner has
/// no image.
std::optional<Box> boxAround(const Eigen::Vector3d& centre_W, double yaw,
                             const Eigen::Vector3d& size, const RigidTransform& T_CW,
                             const CameraModel& camera);

/// What shows under a quarter of itself, or is under `least_px` on its longer side (pixels of the
/// image), is ignored; what shows under a twentieth is not there. Of KITTI: what is largely
/// occluded (2, 3) or truncated is ignored, and so are DontCare regions.
/// Throws StartupError (69) with what is missing and the mend.
LabelledData readLabelled(const LabelRequest& request, const replay::ClassAliases& aliases,
                          double least_px);

}  // namespace perdure::tools
