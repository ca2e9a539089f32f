// JSON schemas of the gateway's messages, as text: Foxglove's well-known schemas, from their public
// field lists, and Perdure's own.
#pragma once

#include <string>

namespace perdure::gateway::schemas {

std::string frameTransforms();
std::string sceneUpdate();
std::string poseInFrame();
std::string posesInFrame();
std::string pointCloud();
std::string log();
std::string cameraCalibration();
std::string imageAnnotations();

std::string objects();
std::string object();
std::string event();
std::string health();
std::string detections();
std::string map();
std::string mapFrame();
std::string mapGraph();
std::string model();
std::string objectRequest();
std::string mapRequest();
std::string mapReply();

/// IDL of foxglove::CompressedImage, which is sent as CDR, because its bytes then need no base64.
std::string compressedImageIdl();

}  // namespace perdure::gateway::schemas
