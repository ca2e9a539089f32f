// Estimates of each object in each frame: INST the causal ones, FINAL the last one, mapped back
// (paper, line 337).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"

namespace perdure::tools {

/// Corners of a convex solid, in half lengths, widths and heights from the centre.
using ShapePoints = std::vector<Eigen::Vector3d>;

/// A row of objects_inst.csv or objects_final.csv: centre in W, metres, radians.
struct ObjectRow {
  std::uint64_t frame = 0;
  TimePoint time;
  ObjectId object_id = 0;
  std::string class_name;
  double score = 0.0;  ///< r·π of the class
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< length, width, height
  double yaw = 0.0;
  bool visible = true;
};

/// Collects by frame; a later message about the same frame replaces the earlier one.
class ObjectHistory {
 public:
  /// Needed for FINAL, to project the last estimate into the frames.
  void setCamera(const CameraCalibration& calibration) { camera_.emplace(calibration); }
  /// Shapes of the classes, also for FINAL; classes without one use their cuboid.
  void setShapes(std::map<std::string, ShapePoints> shapes) { shapes_ = std::move(shapes); }
  void add(const Objects& objects);
  void add(const Event& event);

  /// Confirmed, static, present objects that are not occluded, by frame and id.
  std::vector<ObjectRow> inst() const;
  /// Rows with the surviving id after merges and the last estimate. They start at the first
  /// detection with existence r of at least 0.1. A frame has a row if the object projects into the
  /// image and is not occluded. Occluded means: estimated so at the time, or less than 0.6 visible
  /// beside the last estimates of nearer objects.
  ///
  /// Objects that ended as moving or deleted have no rows. An object that moved before it stopped
  /// at its last position has no rows until then.
  std::vector<ObjectRow> finalRows() const;
  /// The last belief of each confirmed object that was neither deleted nor merged, by id.
  std::vector<ObjectBelief> lastBeliefs() const;
  ObjectId survivorOf(ObjectId id) const;
  std::size_t confirmedNow() const;

 private:
  struct Place {
    Eigen::Vector3d p_W;
    Eigen::Matrix3d covariance;
  };
  struct Look {
    bool hidden = false;           ///< estimated to be occluded
    bool believed = false;         ///< existence is at least 0.1
    std::optional<Place> driving;  ///< position while estimated to be moving
  };
  struct FrameRecord {
    TimePoint time;
    RigidTransform T_WB;
    std::vector<ObjectRow> inst;
    std::map<ObjectId, Look> looks;
  };
  static Place placeOf(const ObjectBelief& object);
  bool endsAsStaticThing(ObjectId id) const;
  std::map<ObjectId, std::uint64_t> lastFramesElsewhere() const;
  std::vector<ObjectRow> finalRowsOf(const FrameRecord& record, std::set<ObjectId>& begun) const;
  std::map<ObjectId, Look> looksOfSurvivors(const FrameRecord& record) const;

  std::map<std::string, ShapePoints> shapes_;
  std::optional<CameraModel> camera_;
  std::map<std::uint64_t, FrameRecord> frames_;
  std::map<ObjectId, ObjectBelief> last_;
  std::map<ObjectId, std::uint64_t> last_frame_;
  std::map<ObjectId, ObjectId> merged_into_;
  std::set<ObjectId> gone_, archived_;
};

}  // namespace perdure::tools
