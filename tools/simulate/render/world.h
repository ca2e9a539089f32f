// A scene in Embree (Wald et al., SIGGRAPH 2014). All static parts form one tree of triangles. Each
// object that moves, appears or disappears is an instance, of which only the transform changes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/sim/scene.h"
#include "tools/simulate/render/embree.h"
#include "tools/simulate/render/surface.h"

namespace perdure::tools {

inline constexpr unsigned kPacket = 8;  ///< rays that Embree traces together
inline constexpr std::uint32_t kNothing = RTC_INVALID_GEOMETRY_ID;

struct Instance {
  std::shared_ptr<const Surface> surface;
  Eigen::Matrix3f R = Eigen::Matrix3f::Identity();
  Eigen::Vector3f p = Eigen::Vector3f::Zero();
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();   ///< W, m/s
  Eigen::Vector3f turn_rate = Eigen::Vector3f::Zero();  ///< W, rad/s
  bool moves = false;                                   ///< moving at the current time
  bool present = true;
};

class World {
 public:
  /// Throws std::runtime_error if Embree cannot start.
  explicit World(const sim::Scene& scene, int threads = 2);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Moves objects to their poses at scene time `t_s`. Returns false if none has moved.
  bool setTime(double t_s);
  const sim::Scene& scene() const { return scene_; }
  /// Element 0 is the scenery, element i + 1 is scene().objects[i].
  const std::vector<Instance>& instances() const { return instances_; }

  /// Finds the nearest hits of the lanes in `valid`; instanceOf returns what they hit.
  void intersect(const int* valid, RTCRayHit8& rays) const;
  /// Sets tfar of a ray to -infinity if a surface is between its tnear and tfar.
  void occluded(const int* valid, RTCRay8& rays) const;

  /// Index of the instance that lane `i` hit, or kNothing.
  static std::uint32_t instanceOf(const RTCRayHit8& rays, unsigned i) {
    if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) return kNothing;
    return movesAlone(rays, i) ? rays.hit.instID[0][i] : rays.hit.geomID[i];
  }
  /// Whether the hit's normal Ng is in the instance's own frame instead of W.
  static bool movesAlone(const RTCRayHit8& rays, unsigned i) {
    return rays.hit.instID[0][i] != RTC_INVALID_GEOMETRY_ID && rays.hit.instID[0][i] != 0;
  }

 private:
  void makeSurfaces(int threads);
  RTCGeometry trianglesOf(const Surface& surface, const Instance& place);
  void attachFixed();
  void attachMoving(std::size_t index);
  void place(std::size_t index);
  bool moves(std::size_t index) const { return index > 0 && geometries_[index] != nullptr; }

  sim::Scene scene_;
  std::vector<Instance> instances_;
  std::vector<RTCGeometry> geometries_;  ///< geometry of moving instances; else null
  RTCDevice device_ = nullptr;
  RTCScene fixed_ = nullptr, top_ = nullptr;  ///< top_: fixed_ and the moving instances
  std::optional<double> time_s_;
};

}  // namespace perdure::tools
