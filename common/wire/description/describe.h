// Describes each message once, field by field with its bounds. Encoding, decoding and JSON use this
// description. `a` is the archive, `d` the domain value, `w` the wire value. Internal to
// common/wire and tools/python.
#pragma once

#include "common/wire/description/describe_base.h"
#include "common/wire/description/describe_objects.h"

namespace perdure::wire {

// --- sensors ---

template <class A, Is<Frame> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.name("camera", d.camera, w.camera);
  a.value("width", d.width, w.width);
  a.value("height", d.height, w.height);
  a.choice("encoding", d.encoding, w.encoding, ImageEncoding::kJpegBgr8);
  a.ensure("width", "out_of_range", [&] { return d.width >= 1 && d.width <= kImageSide; });
  a.ensure("height", "out_of_range", [&] { return d.height >= 1 && d.height <= kImageSide; });
  a.pixels("pixels", d, w);
}

template <class A, Is<ImuSample> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("source", d.source, w.source);
  a.value("sequence", d.sequence, w.seq);
  a.time("time_ns", d.time, w.time_ns);
  a.matrix("gyro", d.gyro, w.gyro, kAngularRate);
  a.matrix("accel", d.accel, w.accel, kAcceleration);
}

template <class A, Is<SpeedSample> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("source", d.source, w.source);
  a.value("sequence", d.sequence, w.seq);
  a.time("time_ns", d.time, w.time_ns);
  a.number("speed", d.speed, w.speed, kSpeed);
  a.number("sigma", d.sigma, w.sigma, kPositive);
}

template <class A, Is<CameraCalibration> D, class W>
void describe(A& a, D& d, W& w) {
  a.name("name", d.name, w.name);
  a.value("width", d.width, w.width);
  a.value("height", d.height, w.height);
  a.ensure("width", "out_of_range", [&] { return d.width >= 1 && d.width <= kImageSide; });
  a.ensure("height", "out_of_range", [&] { return d.height >= 1 && d.height <= kImageSide; });
  a.number("fx", d.fx, w.fx, kPositive);
  a.number("fy", d.fy, w.fy, kPositive);
  a.number("cx", d.cx, w.cx, kPixel);
  a.number("cy", d.cy, w.cy, kPixel);
  a.choice("distortion", d.distortion, w.distortion, DistortionModel::kRational);
  a.numbers("distortion_coefficients", d.distortion_coefficients, w.coefficients, kMatrixEntry,
            kCoefficients);
  a.ensure("distortion_coefficients", "size_mismatch", [&] {
    const std::size_t needed = coefficientsOf(d.distortion);
    return d.distortion_coefficients.size() == needed || d.distortion_coefficients.empty();
  });
  a.pose("T_BC", d.T_BC, w.T_BC);
  a.number("time_offset_s", d.time_offset_s, w.time_offset_s, kOffset);
  a.number("readout_s", d.readout_s, w.readout_s, kOffset);
  a.number("rate_hz", d.rate_hz, w.rate_hz, kNotNegative);
}

template <class A, Is<ImuCalibration> D, class W>
void describe(A& a, D& d, W& w) {
  a.number("gyro_noise", d.gyro_noise, w.gyro_noise, kNotNegative);
  a.number("gyro_bias_walk", d.gyro_bias_walk, w.gyro_bias_walk, kNotNegative);
  a.number("accel_noise", d.accel_noise, w.accel_noise, kNotNegative);
  a.number("accel_bias_walk", d.accel_bias_walk, w.accel_bias_walk, kNotNegative);
  a.number("rate_hz", d.rate_hz, w.rate_hz, kNotNegative);
}

template <class A, Is<GeoAnchor> D, class W>
void describe(A& a, D& d, W& w) {
  a.time("time_ns", d.time, w.time_ns);
  a.number("latitude_deg", d.latitude_deg, w.latitude_deg, kLatitudeDeg);
  a.number("longitude_deg", d.longitude_deg, w.longitude_deg, kLongitudeDeg);
  a.number("height_m", d.height_m, w.height_m, kCoordinate);
  a.number("yaw", d.yaw, w.yaw, kAngle);
}

template <class A, Is<Calibration> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("source", d.source, w.source);
  a.list("cameras", d.cameras, w.cameras, kCameras);
  a.optional("imu", d.imu, w.has_imu, w.imu);
  a.value("has_speed", d.has_speed, w.has_speed);
  a.optional("anchor", d.anchor, w.has_anchor, w.anchor);
}

// --- odometry ---

template <class A, Is<Odometry> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.choice("state", d.state, w.state, OdometryState::kDegraded);
  a.pose("T_WB", d.T_WB, w.T_WB);
  a.matrix("v_WB", d.v_WB, w.v_WB, kSpeed);
  a.symmetric("covariance", d.covariance, w.covariance);
  a.unit("up_W", d.up_W, w.up_W);
  a.matrix("gyro_bias", d.gyro_bias, w.gyro_bias, kAngularRate);
  a.matrix("accel_bias", d.accel_bias, w.accel_bias, kAcceleration);
  a.value("has_increment", d.has_increment, w.has_increment);
  a.value("increment_from", d.increment_from, w.increment_from);
  a.matrix("transition", d.transition, w.transition, kMatrixEntry);
  a.symmetric("increment_covariance", d.increment_covariance, w.increment_covariance);
}

template <class A, Is<Landmark> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("id", d.id, w.landmark_id);
  a.matrix("p_W", d.p_W, w.p_W, kCoordinate);
  a.symmetric("covariance", d.covariance, w.covariance);
  a.matrix("cross_pose", d.cross_pose, w.cross_pose, kMatrixEntry);
  a.matrix("pixel", d.pixel, w.pixel, kPixel);
  a.bytes("descriptor", d.descriptor, w.descriptor);
}

template <class A, Is<Landmarks> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.name("camera", d.camera, w.camera);
  a.list("landmarks", d.landmarks, w.items, kLandmarks);
}

// --- detections ---

template <class A, Is<Detection> D, class W>
void describe(A& a, D& d, W& w) {
  describeBox(a, d.box, w.corners);
  a.numbers("activations", d.activations, w.activations, kLogit, kClasses + 1);
  a.optionalNumber("azimuth", d.azimuth, w.has_azimuth, w.azimuth, kAngle);
  a.number("azimuth_sigma", d.azimuth_sigma, w.azimuth_sigma, kNotNegative);
  a.ensure("azimuth_sigma", "out_of_range", [&] { return !d.azimuth || d.azimuth_sigma > 0; });
  a.value("primed", d.primed, w.primed);
  a.number("sigma_x1", d.side_sigma[0], w.side_sigma[0], kNotNegative);
  a.number("sigma_y1", d.side_sigma[1], w.side_sigma[1], kNotNegative);
  a.number("sigma_x2", d.side_sigma[2], w.side_sigma[2], kNotNegative);
  a.number("sigma_y2", d.side_sigma[3], w.side_sigma[3], kNotNegative);
  a.value("primed_for", d.primed_for, w.primed_for);
}

template <class A, Is<Detections> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.name("camera", d.camera, w.camera);
  a.value("instance", d.instance, w.source);
  a.value("model_hash", d.model_hash, w.model_hash);
  a.list("detections", d.detections, w.items, kDetections);
  a.number("input_scale", d.input_scale, w.input_scale, kInputScale);
  a.number("forward_s", d.forward_s, w.forward_s, kNotNegative);
}

template <class A, Is<ModelInfo> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("hash", d.hash, w.model_hash);
  a.value("instance", d.instance, w.source);
  a.text("name", d.name, w.name, kTextLength);
  a.names("classes", d.classes, w.classes, kClasses);
  a.value("input_width", d.input_width, w.input_width);
  a.value("input_height", d.input_height, w.input_height);
  a.ensure("input_width", "out_of_range", [&] { return d.input_width <= kImageSide; });
  a.ensure("input_height", "out_of_range", [&] { return d.input_height <= kImageSide; });
  a.number("box_sigma", d.box_sigma, w.box_sigma, kNotNegative);
  a.numbers("side_insets", d.side_insets, w.side_insets, kInset, 4 * kClasses);
  a.ensure("side_insets", "size_mismatch",
           [&] { return d.side_insets.empty() || d.side_insets.size() == 4 * d.classes.size(); });
  a.choice("boxes", d.boxes, w.boxes, BoxExtent::kOutline);
}

template <class A, Is<SwapNotice> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("instance", d.instance, w.source);
  a.value("about", d.about, w.about);
  a.choice("step", d.step, w.step, SwapStep::kRetired);
  a.number("probation_s", d.probation_s, w.probation_s, kNotNegative);
  a.text("model", d.model, w.model, kTextLength);
  a.text("reason", d.reason, w.reason, kNameLength);
  a.text("detail", d.detail, w.detail, kTextLength);
}

// --- map ---

template <class A, Is<MapObject> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("id", d.id, w.object_id);
  a.ensure("id", "out_of_range", [&] { return d.id != 0; });
  a.object("world", d.world, w.reference);
  a.name("class_name", d.class_name, w.class_name);
  a.probability("existence", d.existence, w.existence);
  a.probability("class_probability", d.class_probability, w.class_probability);
  a.matrix("mean", d.mean, w.mean, kCoordinate);
  a.covariance("covariance", d.covariance, w.covariance);
  a.time("first_seen_ns", d.first_seen, w.first_seen_ns);
  a.time("last_seen_ns", d.last_seen, w.last_seen_ns);
  a.value("hits", d.hits, w.hits);
  a.choice("visibility", d.visibility, w.visibility, Visibility::kBehind);
  a.choice("memory", d.memory, w.memory, Memory::kLongTerm);
  a.value("provisional", d.provisional, w.provisional);
}

template <class A, Is<MapTile> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("x", d.x, w.x);
  a.value("y", d.y, w.y);
  a.value("part", d.part, w.part);
  a.ensure("part", "out_of_range", [&] { return d.part >= 0; });
  a.value("instance", d.instance, w.source);
  a.value("revision", d.revision, w.revision);
  a.list("objects", d.objects, w.items, kMapTileCapacity);
}

template <class A, Is<MapHeader> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("instance", d.instance, w.source);
  a.value("revision", d.revision, w.revision);
  a.number("tile_size_m", d.tile_size_m, w.tile_size_m, kPositive);
  a.value("tiles", d.tiles, w.tile_count);
  a.value("objects", d.objects, w.object_count);
}

template <class A, Is<MapFrame> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.object("map", d.map, w.map_reference);
  a.pose("T_MW", d.T_MW, w.T_MW);
  a.symmetric("covariance", d.covariance, w.covariance);
  a.value("revision", d.revision, w.revision);
  a.value("sessions", d.sessions, w.session_count);
  a.value("loops", d.loops, w.loop_count);
  a.value("anchors", d.anchors, w.anchor_count);
}

template <class A, Is<Member> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("track", d.track, w.track);
  a.value("object", d.object, w.object);
  a.ensure("object", "out_of_range", [&] { return d.track != 0 && d.object != 0; });
}

template <class A, Is<MapNear> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.value("client", d.client, w.client);
  a.object("world", d.world, w.reference);
  a.value("revision", d.revision, w.revision);
  a.time("kept_ns", d.kept, w.kept_ns);
  a.value("next_id", d.next_id, w.next_object_id);
  a.value("corrects_drift", d.corrects_drift, w.corrects_drift);
  a.value("more", d.more, w.more);
  a.list("members", d.members, w.members, kObjects);
  a.list("placed", d.placed, w.placed, kObjects);
  a.list("as_published", d.as_published, w.as_published, kObjects);
}

template <class A, Is<MapQuery> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("client", d.client, w.client);
  a.value("request", d.request, w.request);
  a.choice("kind", d.kind, w.kind, MapQueryKind::kGraph);
  a.value("object_id", d.object_id, w.object_id);
  a.text("class_name", d.class_name, w.class_name, kNameLength);
  a.matrix("low", d.low, w.low, kCoordinate);
  a.matrix("high", d.high, w.high, kCoordinate);
  a.number("radius", d.radius, w.radius, kNotNegative);
  a.object("world", d.world, w.reference);
  a.value("limit", d.limit, w.limit);
}

template <class A, Is<MapAnchor> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("id", d.id, w.anchor_id);
  a.ensure("id", "out_of_range", [&] { return d.id != 0; });
  a.value("previous", d.previous, w.previous);
  a.object("session", d.session, w.session);
  a.object("map", d.map, w.reference);
  a.matrix("p", d.p, w.position, kCoordinate);
  a.number("yaw", d.yaw, w.yaw, kAngle);
  a.matrix("sigma", d.sigma, w.sigma, kNotNegative);
  a.value("objects", d.objects, w.object_count);
}

template <class A, Is<MapLoopPair> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("known", d.known, w.known);
  a.value("seen", d.seen, w.seen);
}

template <class A, Is<MapLoop> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("id", d.id, w.loop_id);
  a.value("a", d.a, w.a);
  a.value("b", d.b, w.b);
  a.ensure("id", "out_of_range", [&] { return d.id != 0 && d.a != 0 && d.b != 0; });
  a.choice("kind", d.kind, w.kind, MapLoopKind::kTie);
  a.choice("state", d.state, w.state, MapLoopState::kWithdrawn);
  a.matrix("residual", d.residual, w.residual, kCoordinate);
  a.matrix("sigma", d.sigma, w.sigma, kNotNegative);
  a.number("chi2", d.chi2, w.chi2, kNotNegative);
  a.probability("weight", d.weight, w.weight);
  a.list("pairs", d.pairs, w.pairs, kObjects);
  a.value("landmarks", d.landmarks, w.landmark_count);
}

template <class A, Is<MapReply> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("client", d.client, w.client);
  a.value("request", d.request, w.request);
  a.value("instance", d.instance, w.source);
  a.value("ok", d.ok, w.ok);
  a.text("error", d.error, w.error, kTextLength);
  a.value("truncated", d.truncated, w.truncated);
  a.list("objects", d.objects, w.items, kReplyObjects);
  a.list("beliefs", d.beliefs, w.beliefs, kObjects);
  a.list("anchors", d.anchors, w.anchors, kReplyAnchors);
  a.list("loops", d.loops, w.loops, kReplyAnchors);
  a.value("anchor_count", d.anchor_count, w.anchor_count);
  a.value("loop_count", d.loop_count, w.loop_count);
}

// --- health ---

template <class A, Is<Health> D, class W>
void describe(A& a, D& d, W& w) {
  a.name("process", d.process, w.process);
  a.value("instance", d.instance, w.source);
  a.value("pid", d.pid, w.pid);
  a.choice("state", d.state, w.state, HealthState::kFailed);
  a.text("message", d.message, w.message, kTextLength);
  a.value("frames_in", d.frames_in, w.frames_in);
  a.value("frames_out", d.frames_out, w.frames_out);
  a.value("dropped", d.dropped, w.dropped);
  a.number("rate_hz", d.rate_hz, w.rate_hz, kNotNegative);
  a.number("cpu_s", d.cpu_s, w.cpu_s, kNotNegative);
  a.value("rss_bytes", d.rss_bytes, w.rss_bytes);
  a.counts("reasons", d.reasons, w.reasons, kReasons);
}

}  // namespace perdure::wire
