#include "services/gateway/core/channels.h"

namespace perdure::gateway {
namespace {

/// Images are sent as CDR, because their bytes then need no base64.
constexpr char kCompressedImageIdl[] =
    "module foxglove {\n"
    "struct Time { unsigned long sec; unsigned long nsec; };\n"
    "struct CompressedImage {\n"
    "  Time timestamp;\n"
    "  string frame_id;\n"
    "  sequence<octet> data;\n"
    "  string format;\n"
    "};\n"
    "};\n";

ChannelInfo json(std::uint32_t id, std::string topic, const char* schema_name,
                 Delivery delivery = Delivery::kNewest) {
  return {id,           std::move(topic),        "json",  schema_name,
          "jsonschema", jsonSchema(schema_name), delivery};
}

void addCamera(std::size_t index, const std::string& camera, std::vector<ChannelInfo>& table) {
  const std::string prefix = "/camera/" + camera;
  table.push_back({cameraChannel(index, kImage), prefix + "/image", "cdr",
                   "foxglove::CompressedImage", "omgidl", kCompressedImageIdl, Delivery::kNewest});
  table.push_back(json(cameraChannel(index, kCalibration), prefix + "/calibration",
                       "foxglove.CameraCalibration"));
  table.push_back(json(cameraChannel(index, kAnnotations), prefix + "/annotations",
                       "foxglove.ImageAnnotations"));
  table.push_back(
      json(cameraChannel(index, kLikelihood), prefix + "/likelihood", "foxglove.ImageAnnotations"));
}

}  // namespace

std::vector<ChannelInfo> channelTable(const std::vector<std::string>& cameras) {
  std::vector<ChannelInfo> table = {
      json(kTransforms, "/tf", "foxglove.FrameTransforms"),
      json(kScene, "/scene", "foxglove.SceneUpdate"),
      json(kPose, "/pose", "foxglove.PoseInFrame"),
      json(kTrajectory, "/trajectory", "foxglove.PosesInFrame"),
      json(kLandmarks, "/landmarks", "foxglove.PointCloud"),
      json(kLog, "/log", "foxglove.Log", Delivery::kEach),
      json(kHealth, "/health", "perdure.Health"),
      json(kObjects, "/objects", "perdure.Objects"),
      json(kEvents, "/events", "perdure.Event", Delivery::kEach),
      json(kDetections, "/detections", "perdure.Detections"),
      json(kMap, "/map", "perdure.Map"),
      json(kMapToOdom, "/map/frame", "perdure.MapFrame"),
      json(kMapScene, "/map/scene", "foxglove.SceneUpdate"),
      json(kMapGraph, "/map/graph", "perdure.MapGraph"),
      json(kMapGraphScene, "/map/graph/scene", "foxglove.SceneUpdate"),
      json(kMapSeen, "/map/seen", "perdure.SeenGround"),
      json(kModel, "/model", "perdure.Model")};
  for (std::size_t i = 0; i < cameras.size(); ++i) addCamera(i, cameras[i], table);
  return table;
}

ChannelInfo rawChannel(std::uint32_t id, const std::string& topic, const std::string& type,
                       std::string idl) {
  return {id, "/raw/" + topic, "cdr", type, "omgidl", std::move(idl), Delivery::kNewest};
}

std::vector<ServiceInfo> serviceTable() {
  return {{kObjectService, "/object", "perdure.Object", jsonSchema("perdure.ObjectRequest"),
           jsonSchema("perdure.Object")},
          {kMapQueryService, "/map/query", "perdure.MapQuery", jsonSchema("perdure.MapRequest"),
           jsonSchema("perdure.MapReply")},
          {kCorrectService, "/map/correct", "perdure.MapCorrection",
           jsonSchema("perdure.CorrectionRequest"), jsonSchema("perdure.MapReply")}};
}

ServiceInfo nextEventService() {
  return {kNextEventService, "/playback/next_event", "perdure.NextEvent", R"({"type":"object"})",
          jsonSchema("perdure.Event")};
}

}  // namespace perdure::gateway
