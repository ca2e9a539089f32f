#include "services/gateway/core/channels.h"

#include "services/gateway/core/schemas.h"

namespace perdure::gateway {
namespace {

ChannelInfo json(std::uint32_t id, const char* topic, const char* schema_name, std::string schema,
                 Delivery delivery = Delivery::kNewest) {
  return {id, topic, "json", schema_name, "jsonschema", std::move(schema), delivery};
}

void addCamera(std::size_t index, const std::string& camera, std::vector<ChannelInfo>& table) {
  const std::string prefix = "/camera/" + camera;
  table.push_back({cameraChannel(index, kImage), prefix + "/image", "cdr",
                   "foxglove::CompressedImage", "omgidl", schemas::compressedImageIdl(),
                   Delivery::kNewest});
  table.push_back(json(cameraChannel(index, kCalibration), (prefix + "/calibration").c_str(),
                       "foxglove.CameraCalibration", schemas::cameraCalibration()));
  table.push_back(json(cameraChannel(index, kAnnotations), (prefix + "/annotations").c_str(),
                       "foxglove.ImageAnnotations", schemas::imageAnnotations()));
  table.push_back(json(cameraChannel(index, kLikelihood), (prefix + "/likelihood").c_str(),
                       "foxglove.ImageAnnotations", schemas::imageAnnotations()));
}

}  // namespace

std::vector<ChannelInfo> channelTable(const std::vector<std::string>& cameras) {
  using namespace schemas;
  std::vector<ChannelInfo> table = {
      json(kTransforms, "/tf", "foxglove.FrameTransforms", frameTransforms()),
      json(kScene, "/scene", "foxglove.SceneUpdate", sceneUpdate()),
      json(kPose, "/pose", "foxglove.PoseInFrame", poseInFrame()),
      json(kTrajectory, "/trajectory", "foxglove.PosesInFrame", posesInFrame()),
      json(kLandmarks, "/landmarks", "foxglove.PointCloud", pointCloud()),
      json(kLog, "/log", "foxglove.Log", log(), Delivery::kEach),
      json(kHealth, "/health", "perdure.Health", health()),
      json(kObjects, "/objects", "perdure.Objects", objects()),
      json(kEvents, "/events", "perdure.Event", event(), Delivery::kEach),
      json(kDetections, "/detections", "perdure.Detections", detections()),
      json(kMap, "/map", "perdure.Map", map()),
      json(kMapToOdom, "/map/frame", "perdure.MapFrame", mapFrame()),
      json(kMapScene, "/map/scene", "foxglove.SceneUpdate", sceneUpdate()),
      json(kMapGraph, "/map/graph", "perdure.MapGraph", mapGraph()),
      json(kMapGraphScene, "/map/graph/scene", "foxglove.SceneUpdate", sceneUpdate()),
      json(kModel, "/model", "perdure.Model", model())};
  for (std::size_t i = 0; i < cameras.size(); ++i) addCamera(i, cameras[i], table);
  return table;
}

ChannelInfo rawChannel(std::uint32_t id, const std::string& topic, const std::string& type,
                       std::string idl) {
  return {id, "/raw/" + topic, "cdr", type, "omgidl", std::move(idl), Delivery::kNewest};
}

std::vector<ServiceInfo> serviceTable() {
  using namespace schemas;
  return {{kObjectService, "/object", "perdure.Object", objectRequest(), object()},
          {kMapQueryService, "/map/query", "perdure.MapQuery", mapRequest(), mapReply()}};
}

ServiceInfo nextEventService() {
  return {kNextEventService, "/playback/next_event", "perdure.NextEvent", R"({"type":"object"})",
          schemas::event()};
}

}  // namespace perdure::gateway
