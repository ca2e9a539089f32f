#include "services/semantic_filter/config.h"

#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace perdure::semantic_filter {
namespace {

using config::atLeast;
using config::between;
using config::Fields;
using config::positive;

void describeDetector(Parameters& p, Fields& fields) {
  fields.number("box.sigma_px", p.box.sigma_px, positive(),
                {"least standard deviation of a side", "px"});
  fields.number("box.sigma_relative", p.box.sigma_relative, positive(),
                {"added to it, relative to the box, where the model does not say"});
  fields.number("clutter.per_frame", p.clutter.per_frame, positive(),
                {"expected false boxes in an image"});
}

void describePose(PoseParameters& p, Fields& fields) {
  fields.number("pose.walk_position", p.walk_position, atLeast(0),
                {"random walk of the pose error, by distance; exact poses have none", "m/√m"});
  fields.number("pose.walk_rotation", p.walk_rotation, atLeast(0),
                {"the same of their rotation", "rad/√m"});
}

void describeTracks(Parameters& p, Fields& fields) {
  fields.number("motion.survival_s", p.motion.survival_s, positive(),
                {"mean time for which an object stays where it is", "s"});
  fields.number("motion.min_speed", p.motion.min_speed, positive(),
                {"slower objects count as static", "m/s"});
  auto& t = p.tracks;
  fields.number("tracks.confirm", t.confirm, between(0, 1), {"existence that confirms a track"});
  fields.integer("tracks.confirm_hits", t.confirm_hits, between(1, 1000),
                 {"detections that it takes"});
  fields.number(
      "tracks.confirm_sigma_m", t.confirm_sigma_m, positive(),
      {"deviation of its place relative to the body, at most; given up at 1.5 times that", "m"});
  fields.number("tracks.delete_below", t.delete_below, between(0, 1),
                {"existence below which a track is deleted"});
  fields.number("tracks.reidentify_s", t.reidentify_s, atLeast(0),
                {"a deleted track may be re-identified for this time", "s"});
  fields.integer("tracks.max_objects", t.max_objects, between(1, 1000000),
                 {"in the working set; the least likely are deleted"});
  fields.boolean("ground.use", p.ground.use,
                 {"objects that stand near tell how high the ground is"});
  fields.number("ground.body_height_m", p.ground.body_height_m, between(0, 100),
                {"of the IMU above the ground under the vehicle; 0: not known", "m"});
}

void describeMemory(Parameters& p, Fields& fields) {
  fields.boolean("memory.archive", p.memory.archive,
                 {"objects that are far and long unseen wait on the map"});
  fields.number("memory.recall_m", p.memory.recall_m, between(5, 10000),
                {"objects of the map that are nearer to the body are recalled", "m"});
  fields.number("memory.margin_m", p.memory.margin_m, between(3, 10000),
                {"tracks farther than recall_m by more than this are archived", "m"});
  fields.number("memory.after_s", p.memory.after_s, positive(),
                {"once they were not detected for this time", "s"});
}

void describeExpertBox(BoxParameters& p, Fields& fields) {
  fields.number(
      "box.sigma_network_px", p.sigma_network_px, atLeast(0),
      {"least deviation of a side in the network's input, where its size is known", "px"});
  fields.number("box.sigma_weak", p.sigma_weak, atLeast(0),
                {"added to the relative one times the probability that the box is clutter"});
  fields.number("box.border_px", p.border_px, atLeast(0),
                {"the image border censors a side that is nearer", "px"});
  fields.number("box.gate", p.gate, between(0.5, 1.0 - 1e-12),
                {"probability inside the gate of the normalised innovation"});
  fields.number("box.min_size_px", p.min_size_px, positive(),
                {"root of a box's area at which detection is half as likely", "px"});
  fields.number("box.min_network_px", p.min_network_px, positive(),
                {"the same in the network's input, where its size is known", "px"});
  fields.number("box.noise_view", p.noise_view, positive(),
                {"view change that renews the noise of a side", "rad"});
  fields.number("box.amodal", p.amodal, between(0.01, 0.99),
                {"share of boxes that span what an occluder hides of the object"});
  fields.number("box.partial_view", p.partial_view, between(0, 1),
                {"share of boxes that show a part of the object only"});
  fields.number("box.bias_share", p.bias_share, between(0, 0.99),
                {"share of a side's variance that is detector bias"});
  fields.number("box.bias_angle", p.bias_angle, positive(),
                {"view change after which the bias has fallen to 1/e", "rad"});
  fields.number("box.prior_sides", p.prior_sides, atLeast(0),
                {"weight of the assumed noise in sides of boxes, before it is learned; 0: it is "
                 "not learned"});
  fields.number("box.prior_azimuths", p.prior_azimuths, atLeast(0),
                {"the same of azimuths, each of another object"});
}

void describeExpertLikelihood(Parameters& p, Fields& fields) {
  fields.number("clutter.max_log_ratio", p.clutter.max_log_ratio, positive(),
                {"activations are clamped to this against clutter", "nats"});
  fields.number("clutter.other_lookalike", p.clutter.other_lookalike, between(0, 1),
                {"share of objects of no known class that look like a known one"});
  fields.number("clutter.other_prior", p.clutter.other_prior, between(1e-6, 0.999999),
                {"probability of \"other\" at initiation"});
  fields.number("initiation.odds", p.initiation.odds, positive(),
                {"new objects against false boxes, in one box"});
  fields.number("initiation.min_log_ratio", p.initiation.min_log_ratio, {},
                {"weaker boxes support tracks and start none", "nats"});
  fields.number("tempering.correlation", p.tempering.correlation, between(0, 1),
                {"of the errors of two observations from one viewpoint"});
  fields.number("tempering.detection_rate_prior", p.tempering.detection_rate_prior, positive(),
                {"weight of the class's detection probability, in observations"});
  fields.number("visibility.minimum", p.visibility.minimum, between(0, 1),
                {"a smaller visible fraction is no evidence"});
  fields.number(
      "visibility.unmapped_occluder", p.visibility.unmapped_occluder, between(0, 0.99),
      {"that something off the map hides an object, far from the directions of detections"});
  fields.number("visibility.hard_to_detect", p.visibility.hard_to_detect, between(0, 0.9),
                {"that a new view is one from which detections are rare"});
  fields.number("visibility.solid", p.visibility.solid, between(0, 1),
                {"existence from which an object occludes others"});
}

void describeExpertTracks(Parameters& p, Fields& fields) {
  auto& m = p.motion;
  fields.number("motion.position_walk", m.position_walk, atLeast(0),
                {"random walk of a static object", "m/√s"});
  fields.number("motion.acceleration", m.acceleration, positive(),
                {"white acceleration of a moving object", "m/s²/√Hz"});
  fields.number("motion.mover_survival_s", m.mover_survival_s, positive(),
                {"mean time for which an unseen moving object goes on", "s"});
  fields.number("tracks.certain", p.tracks.certain, between(0.9, 0.999999),
                {"existence stays below it, so that misses count"});
  fields.number("tracks.certain_again", p.tracks.certain_again, between(0.9, 0.999999),
                {"the same after a detection on another visit"});
  fields.number("tracks.size_gate", p.tracks.size_gate, positive(),
                {"deviations of a class's size beyond which an object is not of the class"});
  fields.number("tracks.merge_overlap", p.tracks.merge_overlap, between(0, 1),
                {"shared over joint volume at which two tracks are one object"});
  auto& s = p.smoothing;
  fields.integer("smoothing.keyframes", s.keyframes, between(0, kMostKeyframes),
                 {"kept for one track at most; 0: no batch estimate"});
  fields.integer("smoothing.per_frame", s.per_frame, between(1, 10000),
                 {"tracks that are fitted in one frame at most; the others wait"});
}

/// Declares keys of earlier versions with the message that refuses them.
void describeFormer(Fields& fields) {
  using Pairs = std::vector<std::pair<const char*, const char*>>;
  static const Pairs renamed{{"box.sigma_doubt", "box.sigma_weak"},
                             {"box.part", "box.partial_view"},
                             {"box.assumed_sides", "box.prior_sides"},
                             {"box.assumed_azimuths", "box.prior_azimuths"},
                             {"birth.part", "box.partial_view"},
                             {"box.min_height_px", "box.min_size_px, the root of the area"},
                             {"birth.odds", "initiation.odds"},
                             {"birth.min_log_ratio", "initiation.min_log_ratio"},
                             {"looks.correlation", "tempering.correlation"},
                             {"looks.found_prior", "tempering.detection_rate_prior"},
                             {"visibility.screened", "visibility.unmapped_occluder"},
                             {"visibility.elusive", "visibility.hard_to_detect"},
                             {"tend.confirm", "tracks.confirm"},
                             {"tend.confirm_hits", "tracks.confirm_hits"},
                             {"tend.confirm_sigma_m", "tracks.confirm_sigma_m"},
                             {"tend.certain", "tracks.certain"},
                             {"tend.certain_again", "tracks.certain_again"},
                             {"tend.gone", "tracks.delete_below"},
                             {"tend.return_s", "tracks.reidentify_s"},
                             {"tend.size_gate", "tracks.size_gate"},
                             {"tend.merge_overlap", "tracks.merge_overlap"},
                             {"tend.max_objects", "tracks.max_objects"},
                             {"smooth.keyframes", "smoothing.keyframes"},
                             {"smooth.per_frame", "smoothing.per_frame"},
                             {"pose.drift_position", "pose.walk_position, of all odometry"},
                             {"pose.drift_rotation", "pose.walk_rotation, of all odometry"}};
  for (const auto& [old, now] : renamed) fields.formerly(old, std::string("is now ") + now);
  fields.formerly("context", "is gone: context is no longer laid over the classes; leave it out");
  // Former keys that are constants in core/parameters.h now.
  std::istringstream fixed(
      "box.tail box.iterations box.bias_log_distance box.bias_image_angle "
      "clutter.min_size_px clutter.censored_probability birth.claimed birth.max_classes "
      "birth.class_ratio birth.landmark_decay birth.min_landmarks birth.min_distance_m "
      "motion.yaw_walk motion.slow_share motion.creeping motion.lost_sigma_m "
      "motion.start_probability motion.misplaced_odds motion.misplaced_sigma "
      "motion.start_nis looks.angle looks.log_distance looks.image_angle visibility.cell_px "
      "visibility.full visibility.elusive_found visibility.screen_angle "
      "visibility.screen_log_distance tend.gone_tentative tend.tentative_s "
      "tend.class_dominates tend.hypothesis_floor tend.scale_resolved tend.hypothesis_merge "
      "tend.merge_turns tend.merge_inside smooth.least smooth.fresh smooth.patience "
      "smooth.new_view smooth.place smooth.contradicted smooth.least_weight ground.slope "
      "ground.roughness ground.assumed ground.sigma_m ground.reach_m ground.resolved "
      "ground.span_m ground.body_height_sigma_m");
  for (std::string old; fixed >> old;) {
    fields.formerly(old, "is fixed now; leave it out");
  }
  for (const char* old :
       {"alignment.nats", "alignment.margin_nats", "alignment.pairs", "alignment.known_share"}) {
    fields.formerly(old, "is gone: the map store alone searches for earlier maps; leave it out");
  }
  for (const char* old : {"drift.position", "drift.rotation", "drift.things", "drift.within_m"}) {
    fields.formerly(old, "is gone: the map store's graph takes drift out; leave it out");
  }
}

}  // namespace

void describe(Config& c, Fields& fields) {
  fields.text("class_priors", c.class_priors,
              {"file of sizes and detection probabilities by class"});
  fields.integer("history.frames", c.history.frames, between(2, 1000),
                 {"frames for which late detections are still applied"});
  fields.boolean("history.wait_for_detections", c.history.wait_for_detections,
                 {"publish a frame with its detections, or else when the next frame comes; "
                  "false: publish at once, detections show in the next frame"});
  fields.number("restore.timeout_s", c.restore.timeout_s, atLeast(0),
                {"wait so long at the start for the working set of an earlier run", "s"});
  describeDetector(c.filter, fields);
  describePose(c.filter.pose, fields);
  describeTracks(c.filter, fields);
  describeMemory(c.filter, fields);
  fields.expert(true);
  describeExpertBox(c.filter.box, fields);
  describeExpertLikelihood(c.filter, fields);
  describeExpertTracks(c.filter, fields);
  fields.expert(false);
  describeFormer(fields);
}

}  // namespace perdure::semantic_filter
