// A scene as Embree holds it: the scenery is one instance, each object another, so that what moves
// or goes away only changes a transform. Embree 3.13 (Wald et al., SIGGRAPH 2014).
#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/sim/scene.h"
#include "tools/simulate/surface.h"

namespace perdure::tools {

inline constexpr unsigned kPacket = 8;  ///< rays that Embree follows together
inline constexpr std::uint32_t kNothing = RTC_INVALID_GEOMETRY_ID;

/// An object (or all scenery) where it is now.
struct Instance {
  std::shared_ptr<const Surface> surface;
  Eigen::Matrix3f R = Eigen::Matrix3f::Identity();
  Eigen::Vector3f p = Eigen::Vector3f::Zero();
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();   ///< W, m/s
  Eigen::Vector3f turn_rate = Eigen::Vector3f::Zero();  ///< W, rad/s
  bool present = true;
};

class World {
 public:
  /// Throws std::runtime_error where Embree cannot start.
  explicit World(const sim::Scene& scene);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Moves objects to where they are at scene time `t_s`. False where all stay as they were.
  bool setTime(double t_s);
  const sim::Scene& scene() const { return scene_; }
  /// [0] is the scenery, [i + 1] scene().objects[i].
  const std::vector<Instance>& instances() const { return instances_; }

  /// The nearest hits; the instance is hit.instID[0][lane].
  void intersect(const int* valid, RTCRayHit8& rays) const;
  /// Sets tfar to -infinity where something is between tnear and tfar.
  void occluded(const int* valid, RTCRay8& rays) const;

 private:
  RTCScene sceneOf(const Surface& surface);
  void addInstance(std::shared_ptr<const Surface> surface, RTCScene inner);
  void place(std::size_t index);

  sim::Scene scene_;
  std::vector<Instance> instances_;
  std::vector<RTCGeometry> geometries_;
  std::vector<RTCScene> inner_;
  RTCDevice device_ = nullptr;
  RTCScene top_ = nullptr;
  std::optional<double> time_s_;
};

}  // namespace perdure::tools
