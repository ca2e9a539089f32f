#include "services/semantic_filter/config.h"

namespace perdure::semantic_filter {
namespace {

using config::atLeast;
using config::between;
using config::Fields;
using config::positive;

void describeBox(BoxParameters& p, Fields& fields) {
  fields.number("box.sigma_px", p.sigma_px, positive(), {"floor of a side's deviation", "px"});
  fields.number("box.sigma_network_px", p.sigma_network_px, atLeast(0),
                {"the same in the network's input, where its size is known", "px"});
  fields.number("box.sigma_relative", p.sigma_relative, positive(),
                {"a side's deviation relative to the box, where the model does not say"});
  fields.number("box.sigma_doubt", p.sigma_doubt, atLeast(0),
                {"added to it in proportion to the probability that the box is clutter"});
  fields.number("box.border_px", p.border_px, atLeast(0),
                {"a side this near to the image border is cut by it", "px"});
  fields.number("box.gate", p.gate, between(0.5, 1.0 - 1e-12),
                {"probability inside the gate of the normalised innovation"});
  fields.number(
      "box.amodal", p.amodal, between(0.01, 0.99),
      {"share of boxes that span the whole thing where something on the map hides a side"});
  fields.number(
      "box.part", p.part, between(0, 1),
      {"share of boxes that show a part of a thing alone: of whatever shape, or ending at "
       "one side where something hides the rest"});
  fields.number("box.tail", p.tail, atLeast(1),
                {"degrees of freedom of the innovation's t distribution: outliers count less"});
  fields.number("box.min_size_px", p.min_size_px, positive(),
                {"root of a box's area at which detection is half as likely", "px"});
  fields.number("box.min_network_px", p.min_network_px, positive(),
                {"the same in the network's input, where its size is known", "px"});
  fields.number("box.bias_share", p.bias_share, between(0, 0.99),
                {"share of a side's variance that stays with the object while the view stays"});
  fields.number("box.bias_angle", p.bias_angle, positive(),
                {"change of aspect after which it has fallen to 1/e", "rad"});
  fields.number("box.bias_log_distance", p.bias_log_distance, positive(),
                {"the same for the logarithm of the distance"});
  fields.number("box.bias_image_angle", p.bias_image_angle, positive(),
                {"the same for the place in the image", "rad"});
  fields.number(
      "box.noise_view", p.noise_view, positive(),
      {"change of aspect or log distance after which a side's noise is another (half of it "
       "in the image)",
       "rad"});
  fields.number("box.assumed_sides", p.assumed_sides, atLeast(0),
                {"sides of boxes that weigh as much as what is assumed here of a network's errors, "
                 "which are learned; 0: nothing is learned"});
  fields.number("box.assumed_azimuths", p.assumed_azimuths, atLeast(0),
                {"azimuths, each of another thing, that weigh as much as what is assumed of their "
                 "errors (class_priors: azimuth_sigma), which are learned; 0: nothing is learned"});
  fields.integer("box.iterations", p.iterations, between(1, 20), {"of the iterated EKF"});
}

void describeClutter(ClutterParameters& p, Fields& fields) {
  fields.number("clutter.per_frame", p.per_frame, positive(), {"expected false boxes in an image"});
  fields.number("clutter.min_size_px", p.min_size_px, positive(),
                {"least side of a false box", "px"});
  fields.number("clutter.censored_probability", p.censored_probability, between(1e-6, 1),
                {"that a false box is cut at a given side"});
  fields.number("clutter.max_log_ratio", p.max_log_ratio, positive(),
                {"activations are clamped to this against clutter", "nats"});
  fields.number("clutter.other_lookalike", p.other_lookalike, between(0, 1),
                {"share of things of no known class that look like a known one"});
  fields.number("clutter.other_prior", p.other_prior, between(1e-6, 0.999999),
                {"probability of \"other\" at birth"});
}

void describeBirth(InitiationParameters& p, Fields& fields) {
  fields.number("birth.odds", p.odds, positive(), {"new objects in a box against false alarms"});
  fields.number("birth.min_log_ratio", p.min_log_ratio, {},
                {"weaker boxes support objects that are there, and give no birth", "nats"});
  fields.number("birth.claimed", p.explained, between(0, 1),
                {"a box claimed with more than this gives no birth"});
  fields.integer("birth.max_classes", p.max_classes, between(1, 1000),
                 {"classes of the network kept for an object, \"other\" beside them"});
  fields.number("birth.class_ratio", p.class_ratio, between(0, 1),
                {"classes below this share of the best are not kept"});
  fields.number("birth.landmark_decay", p.landmark_decay, positive(),
                {"e-folding distance of a landmark's weight, in half boxes"});
  fields.integer("birth.min_landmarks", p.min_landmarks, between(1, 100000),
                 {"inside a box, before they give its depth"});
  fields.number("birth.min_distance_m", p.min_distance_m, positive(),
                {"least depth of a new object", "m"});
}

void describeMotion(Parameters& p, Fields& fields) {
  auto& m = p.motion;
  fields.number("motion.position_walk", m.position_walk, atLeast(0),
                {"random walk of a static object", "m/√s"});
  fields.number("motion.yaw_walk", m.yaw_walk, atLeast(0), {"the same of its yaw", "rad/√s"});
  fields.number("motion.acceleration", m.acceleration, positive(),
                {"white acceleration of a moving object", "m/s²/√Hz"});
  fields.number("motion.survival_s", m.survival_s, positive(),
                {"mean time for which a thing stays where it is", "s"});
  fields.number("motion.mover_survival_s", m.mover_survival_s, positive(),
                {"mean time for which an unseen mover goes on as it did", "s"});
  fields.number("motion.min_speed", m.min_speed, positive(),
                {"slower objects count as static", "m/s"});
  fields.number("motion.slow_share", p.motion.slow_share, atLeast(0),
                {"of the deviation of a class's speed: what is slower creeps"});
  fields.number("motion.creeping", p.motion.creeping, between(1e-6, 1),
                {"how likely it is that a moving one creeps, against a Gaussian"});
  fields.number("motion.lost_sigma_m", m.lost_sigma_m, positive(),
                {"a moving hypothesis less well placed than this is given up", "m"});
  fields.number("motion.misplaced_odds", m.misplaced_odds, atLeast(0),
                {"of having misplaced a thing against its having driven off"});
  fields.number("motion.misplaced_sigma", m.misplaced_sigma, positive(),
                {"relative, of distance and size"});
  fields.number("motion.start_probability", m.start_probability, between(1e-9, 0.5),
                {"of a moving hypothesis that is added to a static object"});
  fields.number("motion.start_nis", m.start_nis, positive(),
                {"running innovation above which it is added"});
  fields.number("pose.walk_position", p.pose.walk_position, atLeast(0),
                {"random walk of poses that come without covariance", "m/√m"});
  fields.number("pose.walk_rotation", p.pose.walk_rotation, atLeast(0),
                {"the same of their rotation", "rad/√m"});
  fields.number(
      "pose.drift_position", p.pose.drift_position, atLeast(0),
      {"random walk of odometry, in place of the covariance that it says; 0: that", "m/√m"});
  fields.number("pose.drift_rotation", p.pose.drift_rotation, atLeast(0),
                {"the same of its rotation", "rad/√m"});
  fields.number("looks.correlation", p.tempering.correlation, between(0, 1),
                {"of the errors of two looks from the same place"});
  fields.number("looks.angle", p.tempering.angle, positive(),
                {"change of aspect after which that has fallen to 1/e", "rad"});
  fields.number("looks.log_distance", p.tempering.log_distance, positive(),
                {"the same for the logarithm of the distance"});
  fields.number("looks.image_angle", p.tempering.image_angle, positive(),
                {"the same for the place in the image", "rad"});
  fields.number("looks.found_prior", p.tempering.found_prior, positive(),
                {"what P_D is worth beside how often an object was found from there, in looks"});
}

void describeSmooth(SmoothingParameters& p, Fields& fields) {
  fields.integer("smooth.keyframes", p.keyframes, between(0, 100),
                 {"looks that are remembered of an object; 0: nothing is estimated from them"});
  fields.integer("smooth.least", p.least, between(3, 100), {"fewer are not estimated from"});
  fields.number("smooth.fresh", p.fresh, positive(),
                {"share of the looks that is new when an object is smoothed again"});
  fields.integer(
      "smooth.per_frame", p.per_frame, between(1, 10000),
      {"objects that are smoothed in one frame at most, those in most need; the others wait"});
  fields.integer(
      "smooth.patience", p.patience, between(1, 1000),
      {"where smoothing finds little to mend it is done up to so many times more seldom"});
  fields.number("smooth.new_view", p.new_view, positive(),
                {"change of view (b's correlation falls to 1/e at 1) that is remembered"});
  fields.number("smooth.place", p.place, positive(),
                {"relative to the distance: a place less well known is not taken"});
  fields.number("smooth.contradicted", p.contradicted, between(0, 1),
                {"share of the looks that may contradict the rest"});
  fields.number("smooth.least_weight", p.least_weight, between(0, 1),
                {"of a hypothesis that is worth the estimate"});
}

void describeGround(GroundParameters& p, Fields& fields) {
  fields.boolean("ground.use", p.use,
                 {"what stands near by tells how high the ground is that things stand on"});
  fields.number("ground.slope", p.slope, positive(), {"standard deviation of its slope"});
  fields.number("ground.roughness", p.roughness, positive(),
                {"random walk of its height beside that", "m/√m"});
  fields.number("ground.assumed", p.assumed, positive(),
                {"things that weigh as much as these two, until it is known how even it is"});
  fields.number("ground.sigma_m", p.sigma_m, positive(),
                {"standard deviation of a thing's underside beside it", "m"});
  fields.number("ground.reach_m", p.reach_m, positive(),
                {"what stands further away says nothing of it", "m"});
  fields.number("ground.resolved", p.resolved, between(0, 1),
                {"relative deviation of the place of what tells of it, at most"});
  fields.number("ground.span_m", p.span_m, positive(),
                {"over which the undersides of what does not stand on it are spread", "m"});
  fields.number("ground.body_height_m", p.body_height_m, between(0, 100),
                {"of the IMU above the ground that what carries it stands on; 0: not known", "m"});
  fields.number("ground.body_height_sigma_m", p.body_height_sigma_m, positive(),
                {"standard deviation of that", "m"});
}

void describeMemory(MemoryParameters& p, Fields& fields) {
  fields.boolean("memory.archive", p.archive,
                 {"what is far and was not seen for long waits on the map, until it comes near"});
  fields.number("memory.recall_m", p.recall_m, between(5, 10000),
                {"what the map holds nearer to the body comes back", "m"});
  fields.number("memory.margin_m", p.margin_m, between(3, 10000),
                {"what is farther than recall_m by more than this leaves", "m"});
  fields.number("memory.after_s", p.after_s, positive(), {"and was not seen for this time", "s"});
}

void describeAlignment(AlignmentParameters& p, Fields& fields) {
  fields.number("alignment.nats", p.nats, positive(),
                {"log-likelihood ratio against chance from which the map of another frame of "
                 "reference counts as found"});
  fields.number("alignment.margin_nats", p.margin_nats, positive(),
                {"and above the best other way to lay it"});
  fields.integer("alignment.pairs", p.pairs, between(2, 100),
                 {"things that are surely seen and on that map, at least"});
  fields.number("alignment.known_share", p.known_share, between(0.01, 0.99),
                {"of what is seen there is on that map"});
}

void describeDrift(DriftParameters& p, Fields& fields) {
  fields.number("drift.position", p.position, positive(),
                {"odometry's error that the map shows is taken out from here on", "m"});
  fields.number("drift.rotation", p.rotation, positive(), {"or from here on", "rad"});
  fields.integer("drift.things", p.things, between(1, 1000000),
                 {"of earlier visits that were looked at since the last time, at least"});
  fields.number("drift.within_m", p.within_m, positive(),
                {"a thing is looked at once it is so near", "m"});
}

void describeTend(Parameters& p, Fields& fields) {
  auto& v = p.visibility;
  fields.integer("visibility.cell_px", v.cell_px, between(1, 256),
                 {"cell of the depth buffer", "px"});
  fields.number("visibility.minimum", v.minimum, between(0, 1),
                {"visible fraction below which a frame says nothing"});
  fields.number("visibility.full", v.full, between(0, 1), {"fraction that is called visible"});
  fields.number("visibility.screened", v.unmapped_occluder, between(0, 0.99),
                {"that something not on the map hides an object from a view not yet tried"});
  fields.number("visibility.elusive", v.hard_to_detect, between(0, 0.9),
                {"that the network finds an object but seldom from a view not yet tried"});
  fields.number("visibility.elusive_found", v.hard_detection_share, between(0, 1),
                {"at this share of how often it finds others"});
  fields.number("visibility.screen_angle", v.detectability_angle, positive(),
                {"change of aspect after which what is known of that has fallen to 1/e", "rad"});
  fields.number("visibility.screen_log_distance", v.detectability_log_distance, positive(),
                {"the same for the logarithm of the distance"});
  fields.number("visibility.solid", v.solid, between(0, 1),
                {"existence from which an object hides others"});
  auto& t = p.tracks;
  fields.number("tend.confirm", t.confirm, between(0, 1), {"existence that confirms an object"});
  fields.integer("tend.confirm_hits", t.confirm_hits, between(1, 1000),
                 {"and the looks at it that it takes"});
  fields.number("tend.confirm_sigma_m", t.confirm_sigma_m, positive(),
                {"and how well its place beside the body is known; given up at twice that", "m"});
  fields.number("tend.certain", t.certain, between(0.9, 0.999999),
                {"existence is kept below it, so that misses can still be heard"});
  fields.number("tend.certain_again", t.certain_again, between(0.9, 0.999999),
                {"the same of what was found again after the camera had looked away"});
  fields.number("tend.gone", t.gone, between(0, 1), {"existence below which an object is gone"});
  fields.number("tend.gone_tentative", t.gone_tentative, between(0, 1),
                {"the same for one that was never confirmed"});
  fields.number("tend.tentative_s", t.tentative_s, positive(),
                {"out of sight, after which what confirm_hits did not confirm is given up", "s"});
  fields.number("tend.class_dominates", t.class_dominates, between(0.5, 1),
                {"a class above this ends the others"});
  fields.number("tend.size_gate", t.size_gate, positive(),
                {"deviations of a class's size beyond which a thing is not of the class"});
  fields.number("tend.hypothesis_floor", t.hypothesis_floor, between(0, 0.5),
                {"weight below which a hypothesis is pruned"});
  fields.number("tend.scale_resolved", t.scale_resolved, atLeast(0),
                {"relative deviation of the distance until which \"other\" is not ruled out"});
  fields.number("tend.hypothesis_merge", t.hypothesis_merge, atLeast(0),
                {"squared Mahalanobis distance at which two hypotheses are one"});
  fields.number("tend.return_s", t.return_s, atLeast(0),
                {"what is given up and found again in its place within it is the same thing", "s"});
  fields.number("tend.merge_overlap", t.merge_overlap, between(0, 1),
                {"shared over joint volume at which two objects are one"});
  fields.number("tend.merge_turns", t.merge_turns, between(0, 1),
                {"the same of two that were in sight together and never found in one frame"});
  fields.number("tend.merge_inside", p.tracks.merge_inside, positive(),
                {"share of a thing of no known class that lies in a known one and makes it that"});
  fields.integer("tend.max_objects", t.max_objects, between(1, 1000000),
                 {"in the working set; the least likely go"});
}

}  // namespace

void describe(Config& c, Fields& fields) {
  fields.text("class_priors", c.class_priors,
              {"file of sizes and detection probabilities by class"});
  fields.text("context", c.context,
              {"file of what stands near what, from `perdure map learn-context`; empty: off"});
  fields.integer("history.frames", c.history.frames, between(2, 1000),
                 {"frames for which late detections are still applied"});
  fields.boolean("history.wait_for_detections", c.history.wait_for_detections,
                 {"publish a frame with its detections, or else when the next frame comes; "
                  "false: publish at once, detections show in the next frame"});
  fields.number("restore.timeout_s", c.restore.timeout_s, atLeast(0),
                {"wait so long at the start for the working set of an earlier run", "s"});
  describeBox(c.filter.box, fields);
  describeClutter(c.filter.clutter, fields);
  describeBirth(c.filter.initiation, fields);
  describeMotion(c.filter, fields);
  describeTend(c.filter, fields);
  describeSmooth(c.filter.smoothing, fields);
  describeGround(c.filter.ground, fields);
  describeMemory(c.filter.memory, fields);
  describeAlignment(c.filter.alignment, fields);
  describeDrift(c.filter.drift, fields);
}

}  // namespace perdure::semantic_filter
