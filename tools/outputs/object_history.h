// What the filter said of each object in each frame, and the two tables made of it: INST (the
// causal estimate at the frame) and FINAL (the object's last estimate, mapped back; paper, line
// 337).
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

/// Corners of a convex solid, in halves of length, width and height from the middle.
using ShapePoints = std::vector<Eigen::Vector3d>;

/// A line of objects_inst.csv or objects_final.csv: centre in W, metres, radians.
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
  /// Needed for FINAL: which frames the last estimate projects into.
  void setCamera(const CameraCalibration& calibration) { camera_.emplace(calibration); }
  /// By class: what its things fill of their cuboids, for FINAL too. Of the rest no more is known
  /// than the box about the cuboid's image, as before this is told.
  void setShapes(std::map<std::string, ShapePoints> shapes) { shapes_ = std::move(shapes); }
  void add(const Objects& objects);
  void add(const Event& event);

  /// Confirmed, static objects that are claimed to be there and not hidden, by frame and id.
  std::vector<ObjectRow> inst() const;
  /// The surviving id after merges, the last estimate, from the first detection on that made it
  /// more than a faint guess (r of .1), in the frames in which it projects into the image and is
  /// not hidden: neither known to be so at the time, nor with under .6 of it in sight beside the
  /// last estimates of nearer ones. Objects that were judged moving or gone at last give none; what
  /// drove before it came to rest where it is gives none until then.
  std::vector<ObjectRow> finalRows() const;
  /// The last belief of each confirmed object that is not gone and was not merged away, by id.
  std::vector<ObjectBelief> lastBeliefs() const;
  ObjectId survivorOf(ObjectId id) const;
  /// Confirmed objects in the newest message.
  std::size_t confirmedNow() const;

 private:
  struct Place {
    Eigen::Vector3d p_W;
    Eigen::Matrix3d covariance;
  };
  struct Look {
    bool hidden = false;           ///< known to be occluded
    bool believed = false;         ///< more than a faint guess
    std::optional<Place> driving;  ///< where, of what was claimed to be moving
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
