// The messages about objects, described as in describe.h.
#pragma once

#include "common/wire/description/describe_base.h"

namespace perdure::wire {

template <class A, Is<ClassBelief> D, class W>
void describe(A& a, D& d, W& w) {
  a.name("name", d.name, w.name);
  a.probability("probability", d.probability, w.probability);
  a.matrix("mean", d.mean, w.mean, kCoordinate);
  a.covariance("covariance", d.covariance, w.covariance);
  a.matrix("cross_pose", d.cross_pose, w.cross_pose, kMatrixEntry);
}

template <class A, Is<LedgerEntry> D, class W>
void describe(A& a, D& d, W& w) {
  a.number("log_odds", d.log_odds, w.log_odds, kNats);
  a.value("count", d.count, w.count);
  a.time("first_ns", d.first, w.first_ns);
  a.time("last_ns", d.last, w.last_ns);
  a.ensure("last_ns", "out_of_range", [&] { return d.first <= d.last; });
}

template <class A, Is<ClassLedger> D, class W>
void describe(A& a, D& d, W& w) {
  a.name("name", d.name, w.name);
  a.numbers("log_odds", d.log_odds, w.log_odds, kNats, kEvidenceKinds);
}

template <class A, Is<OustedClass> D, class W>
void describe(A& a, D& d, W& w) {
  a.name("name", d.name, w.name);
  a.name("by", d.by, w.by);
  a.time("at_ns", d.at, w.at_ns);
  a.numbers("log_odds", d.log_odds, w.log_odds, kNats, kEvidenceKinds);
}

/// The ledger's fields are members of the belief on the wire (reason: idl/README.md).
template <class A, Is<Ledger> D, class W>
void describe(A& a, D& d, W& w) {
  a.list("existence", d.existence, w.why_existence, kEvidenceKinds);
  a.list("classes", d.classes, w.why_classes, kClasses + 1);
  a.list("ousted", d.ousted, w.why_ousted, 1);
}

template <class D>
bool sumsToOne(const D& classes) {
  double sum = 0;
  for (const auto& c : classes) sum += c.probability;
  return !classes.empty() && sum > 1 - kUnitTolerance && sum < 1 + kUnitTolerance;
}

template <class A, Is<ObjectBelief> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("id", d.id, w.object_id);
  a.ensure("id", "out_of_range", [&] { return d.id != 0; });
  a.probability("existence", d.existence, w.existence);
  a.value("confirmed", d.confirmed, w.confirmed);
  a.list("classes", d.classes, w.classes, kClasses + 1);
  a.ensure("classes", "bad_probabilities", [&] { return sumsToOne(d.classes); });
  a.choice("visibility", d.visibility, w.visibility, Visibility::kBehind);
  a.probability("visible_fraction", d.visible_fraction, w.visible_fraction);
  a.value("blocked_by", d.blocked_by, w.blocked_by);
  a.time("first_seen_ns", d.first_seen, w.first_seen_ns);
  a.time("last_seen_ns", d.last_seen, w.last_seen_ns);
  a.time("as_of_ns", d.as_of, w.as_of_ns);
  a.value("hits", d.hits, w.hits);
  a.value("visible_misses", d.visible_misses, w.visible_misses);
  a.probability("moving", d.moving, w.moving);
  a.matrix("velocity", d.velocity, w.velocity, kSpeed);
  a.choice("memory", d.memory, w.memory, Memory::kLongTerm);
  a.value("recalled", d.recalled, w.recalled);
  a.object("why", d.why, w);
  a.value("track", d.track, w.track);
}

template <class A, Is<EndedTrack> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("track", d.track, w.track);
  a.value("into", d.into, w.into);
  a.time("time_ns", d.time, w.time_ns);
  a.ensure("track", "out_of_range", [&] { return d.track != 0 && d.track != d.into; });
}

template <class A, Is<Objects> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.pose("T_WB", d.T_WB, w.T_WB);
  a.unit("up_W", d.up_W, w.up_W);
  a.value("next_id", d.next_id, w.next_object_id);
  a.list("objects", d.objects, w.items, kObjects);
  a.symmetric("pose_error", d.pose_error, w.pose_error);
  a.value("near_source", d.near_source, w.near_source);
  a.value("near_revision", d.near_revision, w.near_revision);
  a.number("near_m", d.near_m, w.near_m, kNotNegative);
  a.list("ended", d.ended, w.ended, kMostEnded);
}

template <class A, Is<ObjectState> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.object("object", d.object, w.belief);
  a.value("id", d.object.id, w.object_id);  // the key, the only field in a dispose
  a.ensureWire("id", "size_mismatch", [&] { return w.object_id == w.belief.object_id; });
}

template <class A, Is<Event> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.choice("kind", d.kind, w.kind, EventKind::kRelocalised);
  a.value("object_id", d.object_id, w.object_id);
  a.value("other_id", d.other_id, w.other_id);
  a.text("class_name", d.class_name, w.class_name, kNameLength);
  a.probability("probability", d.probability, w.probability);
  a.text("detail", d.detail, w.detail, kTextLength);
  a.number("returns_in", d.returns_in_s[0], w.returns_in[0], kNotNegative);
  a.number("returns_earliest", d.returns_in_s[1], w.returns_in[1], kNotNegative);
  a.number("returns_latest", d.returns_in_s[2], w.returns_in[2], kNotNegative);
}

template <class A, Is<Prediction> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("object_id", d.object_id, w.object_id);
  a.text("class_name", d.class_name, w.class_name, kNameLength);
  describeBox(a, d.box, w.corners);
  a.probability("probability", d.probability, w.probability);
  a.number("velocity_x1", d.velocity[0], w.velocity[0], kPixel);
  a.number("velocity_y1", d.velocity[1], w.velocity[1], kPixel);
  a.number("velocity_x2", d.velocity[2], w.velocity[2], kPixel);
  a.number("velocity_y2", d.velocity[3], w.velocity[3], kPixel);
  a.number("sigma_x1", d.side_sigma[0], w.side_sigma[0], kNotNegative);
  a.number("sigma_y1", d.side_sigma[1], w.side_sigma[1], kNotNegative);
  a.number("sigma_x2", d.side_sigma[2], w.side_sigma[2], kNotNegative);
  a.number("sigma_y2", d.side_sigma[3], w.side_sigma[3], kNotNegative);
}

template <class A, Is<Predictions> D, class W>
void describe(A& a, D& d, W& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.text("camera", d.camera, w.camera, kNameLength);
  a.list("predictions", d.predictions, w.items, kObjects);
}

}  // namespace perdure::wire
