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
                {"minimum standard deviation of a side", "px"});
  fields.number("box.sigma_relative", p.box.sigma_relative, positive(),
                {"standard deviation added to sigma_px, relative to the box size, if the model has "
                 "no value"});
  fields.number("clutter.per_frame", p.clutter.per_frame, positive(),
                {"expected number of false boxes in an image"});
}

void describePose(PoseParameters& p, Fields& fields) {
  fields.number(
      "pose.walk_position", p.walk_position, atLeast(0),
      {"random walk added to the position error, by distance travelled; exact poses have none",
       "m/√m"});
  fields.number("pose.walk_rotation", p.walk_rotation, atLeast(0),
                {"random walk added to the rotation error, by distance travelled", "rad/√m"});
}

void describeTracks(Parameters& p, Fields& fields) {
  fields.number("motion.survival_s", p.motion.survival_s, positive(),
                {"mean time for which a static object keeps its place", "s"});
  fields.number("motion.min_speed", p.motion.min_speed, positive(),
                {"slower objects count as static", "m/s"});
  auto& t = p.tracks;
  fields.number("tracks.confirm", t.confirm, between(0, 1),
                {"existence probability that confirms a track"});
  fields.integer("tracks.confirm_hits", t.confirm_hits, between(1, 1000),
                 {"number of detections that a confirmation requires"});
  fields.number("tracks.confirm_sigma_m", t.confirm_sigma_m, positive(),
                {"largest standard deviation of the position relative to the body that confirms a "
                 "track; the confirmation ends at 1.5 times this value",
                 "m"});
  fields.number("tracks.delete_below", t.delete_below, between(0, 1),
                {"existence probability below which a track is deleted"});
  fields.number("tracks.reidentify_s", t.reidentify_s, atLeast(0),
                {"time for which a deleted track can be re-identified", "s"});
  fields.integer("tracks.max_objects", t.max_objects, between(1, 1000000),
                 {"largest number of objects in the working set; those with the lowest existence "
                  "are deleted"});
  fields.boolean("ground.use", p.ground.use,
                 {"estimate the height of the ground from near objects that stand on it"});
  fields.number("ground.body_height_m", p.ground.body_height_m, between(0, 100),
                {"height of the IMU above the ground under the vehicle; 0: unknown", "m"});
}

void describeMemory(Parameters& p, Fields& fields) {
  fields.boolean("memory.archive", p.memory.archive,
                 {"archive objects on the map that are far and were not detected for a long time"});
  fields.number("memory.recall_m", p.memory.recall_m, between(5, 10000),
                {"distance to the body within which objects of the map are recalled", "m"});
  fields.number("memory.margin_m", p.memory.margin_m, between(3, 10000),
                {"tracks are archived beyond recall_m plus this margin", "m"});
  fields.number("memory.after_s", p.memory.after_s, positive(),
                {"time without a detection before a track is archived", "s"});
}

void describeExpertBox(BoxParameters& p, Fields& fields) {
  fields.number("box.sigma_network_px", p.sigma_network_px, atLeast(0),
                {"minimum standard deviation of a side in the network's input, if the size of the "
                 "input is known",
                 "px"});
  fields.number("box.sigma_weak", p.sigma_weak, atLeast(0),
                {"added to sigma_relative, times the probability that the box is clutter"});
  fields.number("box.border_px", p.border_px, atLeast(0),
                {"distance to the image border within which a side is censored", "px"});
  fields.number("box.gate", p.gate, between(0.5, 1.0 - 1e-12),
                {"probability inside the gate of the normalised innovation"});
  fields.number("box.min_size_px", p.min_size_px, positive(),
                {"square root of the box area at which the detection probability is halved", "px"});
  fields.number("box.min_network_px", p.min_network_px, positive(),
                {"the same in the network's input, if the size of the input is known", "px"});
  fields.number("box.noise_view", p.noise_view, positive(),
                {"view change after which the noise of a side is independent", "rad"});
  fields.number("box.amodal", p.amodal, between(0.01, 0.99),
                {"share of boxes that include the occluded part of the object"});
  fields.number("box.partial_view", p.partial_view, between(0, 1),
                {"share of boxes that show only a part of the object"});
  fields.number("box.bias_share", p.bias_share, between(0, 0.99),
                {"share of the detector bias in the variance of a side"});
  fields.number("box.bias_angle", p.bias_angle, positive(),
                {"view change after which the correlation of the bias is 1/e", "rad"});
  fields.number("box.prior_sides", p.prior_sides, atLeast(0),
                {"weight of the prior of the learned noise, as a number of sides; 0: the noise is "
                 "not learned"});
  fields.number("box.prior_azimuths", p.prior_azimuths, atLeast(0),
                {"the same for azimuths, as a number of objects"});
}

void describeExpertLikelihood(Parameters& p, Fields& fields) {
  fields.number(
      "clutter.max_log_ratio", p.clutter.max_log_ratio, positive(),
      {"largest log-ratio of a class against clutter; larger activations are clamped", "nats"});
  fields.number("clutter.other_lookalike", p.clutter.other_lookalike, between(0, 1),
                {"share of objects of unknown classes that resemble a known class"});
  fields.number("clutter.other_prior", p.clutter.other_prior, between(1e-6, 0.999999),
                {"probability of class \"other\" at the initiation of a track"});
  fields.number("initiation.odds", p.initiation.odds, positive(),
                {"odds that a box without a track is a new object instead of clutter"});
  fields.number("initiation.min_log_ratio", p.initiation.min_log_ratio, {},
                {"log-ratio below which a box does not initiate a track", "nats"});
  fields.number("tempering.correlation", p.tempering.correlation, between(0, 1),
                {"correlation of the errors of two observations from one viewpoint"});
  fields.number("tempering.detection_rate_prior", p.tempering.detection_rate_prior, positive(),
                {"weight of the class's detection probability, in observations"});
  fields.number("visibility.minimum", p.visibility.minimum, between(0, 1),
                {"visible fraction below which a missed detection is not evidence"});
  fields.number("visibility.unmapped_occluder", p.visibility.unmapped_occluder, between(0, 0.99),
                {"probability that an unmapped occluder hides an object, far from the directions "
                 "of detections"});
  fields.number("visibility.hard_to_detect", p.visibility.hard_to_detect, between(0, 0.9),
                {"probability that detections from a new view are rare"});
  fields.number("visibility.solid", p.visibility.solid, between(0, 1),
                {"existence probability from which an object occludes others"});
}

void describeExpertTracks(Parameters& p, Fields& fields) {
  auto& m = p.motion;
  fields.number("motion.position_walk", m.position_walk, atLeast(0),
                {"random walk of a static object", "m/√s"});
  fields.number("motion.acceleration", m.acceleration, positive(),
                {"white acceleration of a moving object", "m/s²/√Hz"});
  fields.number("motion.mover_survival_s", m.mover_survival_s, positive(),
                {"mean survival time of a moving object that is not detected", "s"});
  fields.number(
      "tracks.certain", p.tracks.certain, between(0.9, 0.999999),
      {"largest existence probability of a track, so that missed detections have an effect"});
  fields.number("tracks.certain_again", p.tracks.certain_again, between(0.9, 0.999999),
                {"the same after a detection on another visit"});
  fields.number("tracks.size_gate", p.tracks.size_gate, positive(),
                {"distance to the size of a class, in standard deviations, beyond which the class "
                 "is excluded"});
  fields.number("tracks.merge_overlap", p.tracks.merge_overlap, between(0, 1),
                {"intersection over union of the volumes at which two tracks are one object"});
  auto& s = p.smoothing;
  fields.integer("smoothing.keyframes", s.keyframes, between(0, kMostKeyframes),
                 {"largest number of keyframes of a track; 0: no batch estimate"});
  fields.integer("smoothing.per_frame", s.per_frame, between(1, 10000),
                 {"largest number of tracks that are fitted in one frame; the others wait"});
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
  fields.formerly("context", "was removed: context is not used any more; remove this key");
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
    fields.formerly(old, "is fixed now; remove this key");
  }
  for (const char* old :
       {"alignment.nats", "alignment.margin_nats", "alignment.pairs", "alignment.known_share"}) {
    fields.formerly(old,
                    "was removed: only the map store searches for earlier maps; remove this key");
  }
  for (const char* old : {"drift.position", "drift.rotation", "drift.things", "drift.within_m"}) {
    fields.formerly(old, "was removed: the graph of the map store corrects drift; remove this key");
  }
}

}  // namespace

void describe(Config& c, Fields& fields) {
  fields.text("class_priors", c.class_priors,
              {"file with sizes and detection probabilities by class"});
  fields.integer("history.frames", c.history.frames, between(2, 1000),
                 {"number of past frames to which late detections are applied"});
  fields.boolean("history.wait_for_detections", c.history.wait_for_detections,
                 {"true: publish a frame with its detections, or when the next frame arrives; "
                  "false: publish at once, detections take effect in the next frame"});
  fields.number("restore.timeout_s", c.restore.timeout_s, atLeast(0),
                {"longest wait at the start for the working set of an earlier run", "s"});
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
