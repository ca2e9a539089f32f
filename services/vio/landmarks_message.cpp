#include "services/vio/landmarks_message.h"

#include "services/vio/core/tracks/descriptor.h"

namespace perdure::vio {

Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera, std::vector<Landmark> landmarks,
                           const cv::Mat& image) {
  std::erase_if(landmarks, [](const Landmark& l) {
    return !l.p_W.allFinite() || !l.covariance.allFinite() || !l.cross_pose.allFinite();
  });
  for (Landmark& l : landmarks) {
    l.descriptor = descriptorAt(image, l.pixel).value_or(Descriptor{});
  }
  return {stamp, instance, world, camera, std::move(landmarks)};
}

}  // namespace perdure::vio
