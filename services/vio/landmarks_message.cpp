#include "services/vio/landmarks_message.h"

#include "services/vio/core/tracks/descriptor.h"

namespace perdure::vio {

Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera,
                           const std::vector<LandmarkEstimate>& estimates, const cv::Mat& image) {
  Landmarks out;
  out.stamp = stamp;
  out.instance = instance;
  out.world = world;
  out.camera = camera;
  for (const LandmarkEstimate& e : estimates) {
    if (!e.p_W.allFinite() || !e.covariance.allFinite() || !e.cross_pose.allFinite()) continue;
    Landmark l;
    l.id = e.id;
    l.p_W = e.p_W;
    l.covariance = e.covariance;
    l.cross_pose = e.cross_pose;
    l.pixel = e.pixel;
    l.descriptor = descriptorAt(image, e.pixel).value_or(Descriptor{});
    out.landmarks.push_back(l);
  }
  return out;
}

}  // namespace perdure::vio
