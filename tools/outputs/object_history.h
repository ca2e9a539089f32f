// Estimates of each object in each frame: at that frame (objects_inst.csv), and the last estimate
// transferred back to it (objects_final.csv; paper, line 337).
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

/// Corners of a convex solid about its centre, in units of its half length, half width and half
/// height.
using ShapePoints = std::vector<Eigen::Vector3d>;

/// A row of objects_inst.csv or objects_final.csv: the centre is in W; metres and radians.
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

/// Collects messages by frame. A later message about the same frame replaces the earlier one.
class ObjectHistory {
 public:
  /// Sets the camera that projects the last estimates into the frames for finalRows().
  void setCamera(const CameraCalibration& calibration) { camera_.emplace(calibration); }
  /// Sets the shapes of the classes for finalRows(). Classes without a shape use their cuboid.
  void setShapes(std::map<std::string, ShapePoints> shapes) { shapes_ = std::move(shapes); }
  void add(const Objects& objects);
  void add(const Event& event);

  /// Rows of confirmed, static, present objects that are not occluded, sorted by frame and id.
  std::vector<ObjectRow> inst() const;
  /// Rows with the last estimate of each object and its surviving id after merges. An object's rows
  /// start at the first frame with an existence of at least 0.1. A frame has a row if the object
  /// projects into the image and is not occluded. An object is occluded if it was estimated so at
  /// that frame, or if the last estimates of nearer objects leave less than 0.6 of it visible.
  ///
  /// Objects that were moving or deleted at the end have no rows. The rows of an object that moved
  /// start when it has stopped at its last position.
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
