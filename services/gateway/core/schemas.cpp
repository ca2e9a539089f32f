#include "services/gateway/core/schemas.h"

#include <nlohmann/json.hpp>

namespace perdure::gateway::schemas {
namespace {

using Json = nlohmann::ordered_json;

Json number() { return {{"type", "number"}}; }
Json integer() { return {{"type", "integer"}}; }
Json natural() { return {{"type", "integer"}, {"minimum", 0}}; }
Json text() { return {{"type", "string"}}; }
Json boolean() { return {{"type", "boolean"}}; }
Json bytes() { return {{"type", "string"}, {"contentEncoding", "base64"}}; }
Json listOf(const Json& item) { return {{"type", "array"}, {"items", item}}; }
Json said(Json schema, const char* what) {
  schema["description"] = what;
  return schema;
}

using Members = std::initializer_list<std::pair<const char*, Json>>;
Json object(Members members, const char* title = nullptr) {
  Json json = {{"type", "object"}};
  if (title != nullptr) json["title"] = title;
  for (const auto& [name, schema] : members) json["properties"][name] = schema;
  return json;
}

Json time() { return object({{"sec", natural()}, {"nsec", natural()}}, "time"); }
Json duration() { return object({{"sec", integer()}, {"nsec", natural()}}, "duration"); }
Json vector3() { return object({{"x", number()}, {"y", number()}, {"z", number()}}); }
Json point2() { return object({{"x", number()}, {"y", number()}}); }
Json quaternion() {
  return object({{"x", number()}, {"y", number()}, {"z", number()}, {"w", number()}});
}
Json pose() { return object({{"position", vector3()}, {"orientation", quaternion()}}); }
Json colour() {
  return object({{"r", number()}, {"g", number()}, {"b", number()}, {"a", number()}});
}
Json metadata() { return listOf(object({{"key", text()}, {"value", text()}})); }

Json transform() {
  return object({{"timestamp", time()},
                 {"parent_frame_id", text()},
                 {"child_frame_id", text()},
                 {"translation", vector3()},
                 {"rotation", quaternion()}});
}

Json solid() { return object({{"pose", pose()}, {"size", vector3()}, {"color", colour()}}); }
Json arrow() {
  return object({{"pose", pose()},
                 {"shaft_length", number()},
                 {"shaft_diameter", number()},
                 {"head_length", number()},
                 {"head_diameter", number()},
                 {"color", colour()}});
}
Json cylinder() {
  return object({{"pose", pose()},
                 {"size", vector3()},
                 {"bottom_scale", number()},
                 {"top_scale", number()},
                 {"color", colour()}});
}
Json lines() {
  return object({{"type", natural()},
                 {"pose", pose()},
                 {"thickness", number()},
                 {"scale_invariant", boolean()},
                 {"points", listOf(vector3())},
                 {"color", colour()},
                 {"colors", listOf(colour())},
                 {"indices", listOf(natural())}});
}
Json triangles() {
  return object({{"pose", pose()},
                 {"points", listOf(vector3())},
                 {"color", colour()},
                 {"colors", listOf(colour())},
                 {"indices", listOf(natural())}});
}
Json textPrimitive() {
  return object({{"pose", pose()},
                 {"billboard", boolean()},
                 {"font_size", number()},
                 {"scale_invariant", boolean()},
                 {"color", colour()},
                 {"text", text()}});
}
Json model3d() {
  return object({{"pose", pose()},
                 {"scale", vector3()},
                 {"color", colour()},
                 {"override_color", boolean()},
                 {"url", text()},
                 {"media_type", text()},
                 {"data", bytes()}});
}

Json entity() {
  return object({{"timestamp", time()},
                 {"frame_id", text()},
                 {"id", text()},
                 {"lifetime", duration()},
                 {"frame_locked", boolean()},
                 {"metadata", metadata()},
                 {"arrows", listOf(arrow())},
                 {"cubes", listOf(solid())},
                 {"spheres", listOf(solid())},
                 {"cylinders", listOf(cylinder())},
                 {"lines", listOf(lines())},
                 {"triangles", listOf(triangles())},
                 {"texts", listOf(textPrimitive())},
                 {"models", listOf(model3d())}});
}

/// Schema of one object, common to `objects` and the map.
Json glance() {
  return object({{"id", natural()},
                 {"class", text()},
                 {"p", said(number(), "probability of the class")},
                 {"r", said(number(), "probability that it exists")},
                 {"c", said(listOf(number()), "centre in frame_id, m")},
                 {"yaw", said(number(), "about the vertical, rad")},
                 {"size", said(listOf(number()), "length, width, height, m")},
                 {"cov", said(listOf(number()), "of the centre, m^2: xx xy xz yy yz zz")},
                 {"yaw_sigma", number()},
                 {"size_sigma", said(listOf(number()), "standard deviation, m")},
                 {"visibility", said(text(), "visible, partial, occluded, out_of_view, behind")},
                 {"fraction", said(number(), "of it that is visible")},
                 {"blocked_by", said(natural(), "id of what hides it; 0: nothing that has one")},
                 {"confirmed", boolean()},
                 {"moving", said(number(), "probability that it moves")},
                 {"velocity", said(listOf(number()), "m/s")},
                 {"hits", natural()},
                 {"first_s", said(number(), "first seen, s of the sensor clock")},
                 {"last_s", said(number(), "last seen, s of the sensor clock")},
                 {"recalled", said(boolean(), "came back from the map and not seen since")},
                 {"provisional", said(boolean(), "its session is not found on the map yet")},
                 {"elsewhere", said(boolean(), "on a map whose place in `map` is not known")}});
}

}  // namespace

std::string frameTransforms() {
  return object({{"transforms", listOf(transform())}}, "foxglove.FrameTransforms").dump();
}

std::string sceneUpdate() {
  const Json deletion = object({{"timestamp", time()}, {"type", natural()}, {"id", text()}});
  return object({{"deletions", listOf(deletion)}, {"entities", listOf(entity())}},
                "foxglove.SceneUpdate")
      .dump();
}

std::string poseInFrame() {
  return object({{"timestamp", time()}, {"frame_id", text()}, {"pose", pose()}},
                "foxglove.PoseInFrame")
      .dump();
}

std::string posesInFrame() {
  return object({{"timestamp", time()}, {"frame_id", text()}, {"poses", listOf(pose())}},
                "foxglove.PosesInFrame")
      .dump();
}

std::string pointCloud() {
  const Json field = object({{"name", text()}, {"offset", natural()}, {"type", natural()}});
  return object({{"timestamp", time()},
                 {"frame_id", text()},
                 {"pose", pose()},
                 {"point_stride", natural()},
                 {"fields", listOf(field)},
                 {"data", bytes()}},
                "foxglove.PointCloud")
      .dump();
}

std::string log() {
  return object({{"timestamp", time()},
                 {"level", natural()},
                 {"message", text()},
                 {"name", text()},
                 {"file", text()},
                 {"line", natural()}},
                "foxglove.Log")
      .dump();
}

std::string cameraCalibration() {
  return object({{"timestamp", time()},
                 {"frame_id", text()},
                 {"width", natural()},
                 {"height", natural()},
                 {"distortion_model", text()},
                 {"D", listOf(number())},
                 {"K", listOf(number())},
                 {"R", listOf(number())},
                 {"P", listOf(number())}},
                "foxglove.CameraCalibration")
      .dump();
}

std::string imageAnnotations() {
  const Json circle = object({{"timestamp", time()},
                              {"position", point2()},
                              {"diameter", number()},
                              {"thickness", number()},
                              {"fill_color", colour()},
                              {"outline_color", colour()},
                              {"metadata", metadata()}});
  const Json points = object({{"timestamp", time()},
                              {"type", natural()},
                              {"points", listOf(point2())},
                              {"outline_color", colour()},
                              {"outline_colors", listOf(colour())},
                              {"fill_color", colour()},
                              {"thickness", number()},
                              {"metadata", metadata()}});
  const Json label = object({{"timestamp", time()},
                             {"position", point2()},
                             {"text", text()},
                             {"font_size", number()},
                             {"text_color", colour()},
                             {"background_color", colour()},
                             {"metadata", metadata()}});
  return object({{"timestamp", time()},
                 {"circles", listOf(circle)},
                 {"points", listOf(points)},
                 {"texts", listOf(label)},
                 {"metadata", metadata()}},
                "foxglove.ImageAnnotations")
      .dump();
}

std::string objects() {
  return object({{"timestamp", time()},
                 {"frame_id", text()},
                 {"world", said(text(), "a new one, or a new epoch, is a new frame of reference")},
                 {"epoch", natural()},
                 {"sequence", natural()},
                 {"latency_ms", said(number(), "from capture; below 0: not known")},
                 {"body", said(listOf(number()), "pose: x y z, quaternion x y z w")},
                 {"up", said(listOf(number()), "against gravity; yaws are about it")},
                 {"objects", listOf(glance())}},
                "perdure.Objects")
      .dump();
}

std::string object() {
  const Json belief = object({{"class", text()},
                              {"p", number()},
                              {"mean", said(listOf(number()), "x y z yaw log l, log w, log h")},
                              {"covariance", said(listOf(listOf(number())), "7 x 7")}});
  return object(
             {{"found", boolean()},
              {"object", glance()},
              {"classes", listOf(belief)},
              {"existence", said(Json{{"type", "object"}}, "evidence by kind, nats and counts")},
              {"ledger", said(Json{{"type", "object"}}, "of each class: evidence by kind, nats")},
              {"ousted", said(Json{{"type", "object"}}, "the class that was given up last")},
              {"returns", said(Json{{"type", "object"}}, "when it should be seen again, s")},
              {"history", said(listOf(listOf(number())), "time s, r, p, visible fraction")}},
             "perdure.Object")
      .dump();
}

std::string event() {
  return object({{"timestamp", time()},
                 {"world", said(text(), "which odom frame, with the epoch")},
                 {"epoch", natural()},
                 {"event", text()},
                 {"object_id", natural()},
                 {"other_id", natural()},
                 {"class", text()},
                 {"probability", number()},
                 {"detail", text()},
                 {"returns_in_s", said(listOf(number()), "expected, and a 90 % interval")},
                 {"at", said(listOf(number()), "x y z in odom, where it is known")}},
                "perdure.Event")
      .dump();
}

std::string health() {
  const Json service = object({{"process", text()},
                               {"state", text()},
                               {"message", text()},
                               {"age_s", said(number(), "since it was heard")},
                               {"frames_in", natural()},
                               {"frames_out", natural()},
                               {"dropped", natural()},
                               {"rate_hz", number()},
                               {"cpu", said(number(), "of one core; below 0: not known yet")},
                               {"rss_mb", number()},
                               {"reasons", Json{{"type", "object"}}},
                               {"stood_in_for", said(boolean(), "another process does its work")}});
  return object({{"vehicle", text()},
                 {"services", listOf(service)},
                 {"silent_s", said(object({{"objects", number()}, {"odometry", number()}}),
                                   "since the last message; below 0: none came")}},
                "perdure.Health")
      .dump();
}

std::string detections() {
  const Json one = object({{"box", said(listOf(number()), "x1 y1 x2 y2, px")},
                           {"class", said(text(), "the likeliest against clutter")},
                           {"nats", said(number(), "log-likelihood ratio against clutter")},
                           {"primed", boolean()}});
  return object({{"timestamp", time()},
                 {"camera", text()},
                 {"sequence", natural()},
                 {"detections", listOf(one)}},
                "perdure.Detections")
      .dump();
}

std::string map() {
  return object({{"timestamp", time()},
                 {"frame_id", text()},
                 {"all", said(natural(), "objects on the map")},
                 {"elsewhere", said(natural(), "objects of maps whose place here is not known")},
                 {"objects", said(listOf(glance()), "those nearest to the body")}},
                "perdure.Map")
      .dump();
}

std::string mapFrame() {
  return object({{"timestamp", time()},
                 {"world", text()},
                 {"epoch", natural()},
                 {"map", said(text(), "the world that the map began as")},
                 {"map_epoch", natural()},
                 {"T_MW", said(listOf(number()), "odom in map: x y z, quaternion x y z w")},
                 {"body_sigma",
                  said(listOf(number()), "of the body in map: x y z m, yaw rad; empty: not known")},
                 {"revision", said(natural(), "changes of the graph")},
                 {"sessions", said(natural(), "that hang together with this one, itself included")},
                 {"loops", said(natural(), "that are believed")},
                 {"anchors", natural()}},
                "perdure.MapFrame")
      .dump();
}

std::string mapGraph() {
  const Json anchor =
      object({{"id", natural()},
              {"previous", said(natural(), "of the same session; 0: none")},
              {"session", said(text(), "the odom frame of its way, world/epoch")},
              {"at", said(listOf(number()), "x y z in map, m")},
              {"yaw", number()},
              {"sigma", said(listOf(number()), "x y z m, yaw rad, relative to the first anchor")},
              {"objects", said(natural(), "that were last seen from there")}});
  const Json loop = object(
      {{"id", natural()},
       {"a", said(natural(), "the anchor that was known")},
       {"b", said(natural(), "the anchor where the vehicle was")},
       {"kind", said(text(), "loop, or tie: by objects with their ids")},
       {"state", said(text(), "tentative, confirmed, withdrawn")},
       {"residual", said(listOf(number()),
                         "measured less as it lies: x y z m, yaw rad, in "
                         "axes of a")},
       {"sigma", said(listOf(number()), "of the measurement; empty: not known")},
       {"chi2", said(number(), "of the residual, 4 degrees of freedom")},
       {"weight", said(number(), "by which it counts, 0 to 1")},
       {"pairs", said(listOf(listOf(natural())), "ids that it found to be one: known, seen")},
       {"landmarks", said(natural(), "that look alike")}});
  return object({{"timestamp", time()},
                 {"frame_id", text()},
                 {"why_none", said(text(), "a sentence, where there is no graph")},
                 {"all_anchors", said(natural(), "of the map")},
                 {"all_loops", natural()},
                 {"truncated", said(boolean(), "these are the nearest to the vehicle")},
                 {"anchors", listOf(anchor)},
                 {"loops", said(listOf(loop), "between these anchors")}},
                "perdure.MapGraph")
      .dump();
}

std::string model() {
  return object({{"name", text()},
                 {"hash", text()},
                 {"classes", listOf(text())},
                 {"input_width", natural()},
                 {"input_height", natural()}},
                "perdure.Model")
      .dump();
}

std::string objectRequest() { return object({{"id", natural()}}, "perdure.ObjectRequest").dump(); }

std::string mapRequest() {
  return object({{"id", natural()},
                 {"class", text()},
                 {"near", said(listOf(number()), "x y z, m; with radius")},
                 {"radius", number()},
                 {"low", said(listOf(number()), "x y z, m: a box, with high")},
                 {"high", listOf(number())},
                 {"limit", natural()}},
                "perdure.MapRequest")
      .dump();
}

std::string mapReply() {
  return object({{"truncated", boolean()}, {"objects", listOf(glance())}}, "perdure.MapReply")
      .dump();
}

std::string compressedImageIdl() {
  return "module foxglove {\n"
         "struct Time { unsigned long sec; unsigned long nsec; };\n"
         "struct CompressedImage {\n"
         "  Time timestamp;\n"
         "  string frame_id;\n"
         "  sequence<octet> data;\n"
         "  string format;\n"
         "};\n"
         "};\n";
}

}  // namespace perdure::gateway::schemas
