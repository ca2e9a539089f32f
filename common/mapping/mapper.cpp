#include "common/mapping/mapper.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/mapping/frames/level_errors.h"
#include "common/mapping/graph/components.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr double kOverlap_m = 3.0;  // distance travelled by which the views of two anchors overlap

}  // namespace

Mapper::Mapper(const Parameters& parameters, SavedMap saved)
    : parameters_(parameters),
      state_(parameters, std::move(saved)),
      builder_(parameters.anchor),
      loop_search_(parameters),
      view_search_(parameters),
      tracked_ties_(parameters),
      loop_book_(parameters.loop) {}

/// Stores the last position of the previous session. Its standard deviation allows for motion at
/// the last speed during the gap. Stores nothing after a gap above one minute.
void Mapper::rememberLastPlace(const Odometry& next) {
  constexpr double kAtRest_m = 2.0, kLeastSpeed = 1.0, kLongest_s = 60.0;
  const auto before = std::exchange(newest_odometry_, std::nullopt);
  ended_.reset();
  if (!before || !builder_.last() || session_ == next.world) return;
  const double gap_s = toSeconds(next.stamp.time - before->time);
  if (gap_s < 0.0 || gap_s > kLongest_s) return;
  ended_ = {builder_.last()->id, 0, builder_.sinceLast()->mean,
            kAtRest_m + gap_s * std::max(kLeastSpeed, before->speed)};
}

/// Returns the position at which the session began, by the last one. The yaw of this W in M is
/// unknown.
std::optional<LastPlace> Mapper::lastPlace() const {
  constexpr double kTurns_rad = 10.0, kFarthest_m = 150.0;
  if (!ended_ || ended_->begins == 0 || builder_.way_m() > kFarthest_m) return std::nullopt;
  LastPlace last{ended_->anchor, ended_->begins, {}};
  last.T_MF.mean = state_.graph().pose(ended_->anchor) * ended_->T_AB;
  last.T_MF.covariance = ended_->sigma_m * ended_->sigma_m * Eigen::Matrix4d::Identity();
  last.T_MF.covariance(3, 3) = kTurns_rad * kTurns_rad;
  return last;
}

/// Begins a session. A known session continues from its newest anchor.
void Mapper::begin(const Odometry& odometry) {
  rememberLastPlace(odometry);
  session_ = odometry.world;
  state_.follow(odometry.world);
  dropTentativeLoops();
  builder_ = AnchorBuilder(parameters_.anchor);
  if (const auto last = state_.newestOf(odometry.world)) builder_.resume(*last);
  continueDrift(odometry.world);
  searched_at_m_ = searched_widely_at_m_ = searched_elsewhere_at_m_ = builder_.way_m();
  seen_ = searched_with_ = 0;
  active_.reset();
  tentative_elsewhere_.reset();
  tentative_widely_.reset();
  marginals_.reset();
  loop_search_.forget();
  view_builder_.clear();
  tracked_ties_.begin();
}

/// Removes tentative loop closures from the graph, except those that replaced accepted ones,
/// because object ids depend on these.
void Mapper::dropTentativeLoops() {
  for (const EdgeId id : loop_book_.begin()) {
    if (state_.identity().factsOf(id).empty()) state_.removeLoop(id);
  }
}

/// Sets the scale of the session's odometry errors: in a replay that of the anchors, which must not
/// change, else an estimate from the loops.
void Mapper::continueDrift(const WorldId& session) {
  const auto last = state_.newestOf(session);
  odometry_variance_ = last ? last->scale : DriftVariance();
  learnDrift();
}

void Mapper::stand(const Anchor& anchor) {
  builder_ = AnchorBuilder(parameters_.anchor);
  builder_.resume(anchor);
  marginals_.reset();
}

void Mapper::replay(const WorldId& session) {
  std::vector<AnchorId> way;
  for (const auto& [id, anchor] : state_.anchors()) {
    if (anchor.session == session) way.push_back(id);
  }
  if (way.empty()) return;
  session_ = session;
  state_.follow(session);
  dropTentativeLoops();
  active_.reset();
  tentative_elsewhere_.reset();
  tentative_widely_.reset();
  replays_ = true;
  continueDrift(session);
  tracked_ties_.begin();
  searched_widely_at_m_ = searched_elsewhere_at_m_ = learned_at_m_ =
      -parameters_.loop.elsewhere_each_m;
  loop_search_.forget();
  for (const AnchorId id : way) {
    stand(state_.anchors().at(id));
    search();
  }
  replays_ = false;
  searched_at_m_ = searched_widely_at_m_ = learned_at_m_ = builder_.way_m();
}

void Mapper::onOdometry(const Odometry& odometry) {
  if (odometry.state == OdometryState::kInitialising) return;
  if (session_ != odometry.world) begin(odometry);
  newest_odometry_ = {odometry.stamp.time, odometry.v_WB.norm()};
  const auto before = builder_.last();
  auto anchor = builder_.add(odometry, state_.nextAnchor());
  if (!anchor) return;
  if (before) {  // its view has the landmarks observed since that anchor
    state_.putView(before->id,
                   view_builder_.viewFrom(before->T_WA, builder_.way_m(),
                                          builder_.way_m() - before->way_m + kOverlap_m));
  }
  anchor->from_previous.covariance = odometry_variance_.of(anchor->from_previous.covariance);
  anchor->scale = odometry_variance_;
  state_.add(*anchor);
  if (ended_ && ended_->begins == 0) ended_->begins = anchor->id;
  marginals_.reset();
}

Whereabouts Mapper::body(double widening) {
  const auto to_first = marginals().to(marginals().first());
  const double deviation_m = to_first ? widening * planeSigma(to_first->covariance) : 0.0;
  return {state_, builder_, marginals(), widening, deviation_m, replays_};
}

bool Mapper::isOld(const ObjectRecord& record) const {
  return !session_ || record.session != *session_ ||
         std::abs(builder_.way_m() - record.way_m) > parameters_.loop.visit_m;
}

/// Returns the object with its covariance given the body's pose, that is without the part that the
/// pose error explains.
PlacedObject Mapper::placedOf(const ObjectBelief& belief, const Matrix6d& pose_error) {
  const ClassBelief& best = belief.best();
  PlacedObject o;
  o.id = belief.id;
  o.p = best.mean.head<3>();
  o.yaw = best.mean[3];
  const Eigen::Matrix<double, 4, 6> C = best.cross_pose.topRows<4>();
  o.covariance = best.covariance.topLeftCorner<4, 4>() - regressOn(pose_error, C) * C.transpose();
  o.covariance.diagonal().array() += 1e-6;
  if (!isCovariance(o.covariance)) o.covariance = best.covariance.topLeftCorner<4, 4>();
  for (const ClassBelief& c : belief.classes) {
    o.pmf.push_back({state_.numberOf(c.name), c.probability});
  }
  return o;
}

void Mapper::see(const ObjectBelief& belief, const Objects& objects) {
  const Anchor& anchor = *builder_.last();
  const LevelPose T_AW = levelOf(anchor.T_WA.inverse());
  PlacedObject o = placedOf(belief, objects.pose_error);
  o.p = anchor.T_WA.inverse() * o.p;
  o.yaw = wrapAngle(o.yaw + T_AW.yaw);
  o.covariance = turnedBy(T_AW.R(), o.covariance);
  const Eigen::Matrix4d J = byFrame(o.p - builder_.sinceLast()->mean.p);
  o.covariance += J * builder_.sinceLast()->covariance * J.transpose();

  ObjectRecord record;
  const ObjectRecord* known = state_.recordOfTrack(belief.id);
  if (known == nullptr) {
    ++seen_;
  } else {
    record = *known;
    if (isOld(record)) record.earlier = record.sighting;
  }
  record.session = *session_;
  record.way_m = builder_.way_m();
  record.last_seen = belief.last_seen;
  record.confirmed = record.confirmed || belief.confirmed;
  record.gone = false;
  record.pose_error = objects.pose_error;
  record.sighting = {anchor.id, std::move(o)};
  state_.put(belief.id, std::move(record));
}

void Mapper::onLandmarks(const Landmarks& landmarks) {
  if (!follows(landmarks.world)) return;
  const Anchor& here = *builder_.last();
  const Eigen::Vector3d p_WB = here.T_WA * builder_.sinceLast()->mean.p;
  view_builder_.add(landmarks, p_WB, builder_.way_m());
}

void Mapper::onObjects(const Objects& objects) {
  if (!session_ || objects.world != *session_ || !builder_.last()) return;
  for (const ObjectBelief& belief : objects.objects) {
    if (belief.moving > 0.5 || belief.classes.empty() || belief.recalled) continue;
    if (!belief.confirmed && (belief.existence < 0.5 || belief.hits < 2)) continue;
    const ObjectRecord* known = state_.recordOfTrack(belief.id);
    const bool seen_now =
        known == nullptr || belief.last_seen > known->last_seen || known->session != *session_;
    if (seen_now) see(belief, objects);
  }
  // If the odometry was reset and the body does not move, additional objects can locate it.
  const bool more = ended_ && seen_ > searched_with_;
  if (!more && builder_.way_m() - searched_at_m_ < parameters_.loop.search_each_m) return;
  searched_at_m_ = builder_.way_m();
  searched_with_ = seen_;
  forgetUnconfirmed();
  tie();
  search();
}

/// Removes unconfirmed objects of earlier visits.
void Mapper::forgetUnconfirmed() {
  std::vector<ObjectId> old;
  for (const ObjectId id : state_.unconfirmed()) {
    if (isOld(state_.records().at(id))) old.push_back(id);
  }
  for (const ObjectId id : old) {
    const std::vector<TrackId> tracks = state_.identity().tracksOf(id);
    state_.erase(id);
    for (const TrackId track : tracks) state_.erase(track);
  }
}

void Mapper::onMerged(TrackId survivor, TrackId absorbed, bool confirmed) {
  if (const ObjectRecord* from = state_.recordOfTrack(absorbed)) {
    confirmed = confirmed || from->confirmed;
    ObjectRecord merged = *from;
    if (const ObjectRecord* into = state_.recordOfTrack(survivor)) {
      const bool either = merged.confirmed || into->confirmed;
      if (!state_.isNewer(merged, *into)) {
        merged = *into;
      } else if (isOld(*into)) {
        merged.earlier = into->sighting;
      } else if (!merged.earlier) {
        merged.earlier = into->earlier;
      }
      merged.confirmed = either;
    }
    state_.erase(absorbed);
    state_.put(survivor, std::move(merged));
  }
  if (confirmed) state_.unite({0, survivor, absorbed});
  loop_search_.forget();
}

void Mapper::onGone(TrackId id) {
  state_.end(id);
  loop_search_.forget();
}

void Mapper::onCorrection(const Correction& correction) {
  state_.put(correction);
  if (correction.aboutTwo()) loop_search_.forget();
}

const Marginals& Mapper::marginals() {
  if (!marginals_) {
    marginals_ = std::make_unique<Marginals>(state_.graph(), builder_.last()->id);
  }
  return *marginals_;
}

std::vector<Recallable> Mapper::near(const Eigen::Vector3d& centre_W, double radius_m) {
  std::vector<Recallable> result;
  if (!builder_.last()) return result;
  const Anchor& here = *builder_.last();
  const Eigen::Vector3d centre_M = state_.graph().pose(here.id) * (here.T_WA.inverse() * centre_W);
  constexpr double kSeenWithin_m = 60.0;  // largest expected distance of an object from its anchor
  for (const auto& [anchor, pose] : state_.graph().poses()) {
    if ((pose.p - centre_M).norm() > radius_m + kSeenWithin_m) continue;
    std::optional<Recallable> of_anchor;
    bool asked = false;
    for (const ObjectId id : state_.seenFrom(anchor)) {
      const ObjectRecord& record = state_.records().at(id);
      if (!record.confirmed || record.sighting.anchor != anchor) continue;
      if ((pose * record.sighting.in_anchor.p - centre_M).norm() > radius_m) continue;
      if (!std::exchange(asked, true)) of_anchor = relativeTo(here, state_.anchors().at(anchor));
      if (!of_anchor) break;
      result.push_back(withRecord(*of_anchor, id, record));
    }
  }
  return result;
}

Recallable Mapper::withRecord(Recallable there, ObjectId id, const ObjectRecord& record) const {
  there.id = id;
  there.track = record.sighting.in_anchor.id;
  there.pose_error = record.pose_error;
  return there;
}

std::optional<Recallable> Mapper::placeOf(TrackId track) {
  const ObjectRecord* record = state_.recordOfTrack(track);
  if (record == nullptr || record->gone || !builder_.last()) return std::nullopt;
  auto there = relativeTo(*builder_.last(), state_.anchors().at(record->sighting.anchor));
  if (!there) return std::nullopt;
  return withRecord(*std::move(there), state_.identity().objectOf(track), *record);
}

const ObjectRecord* Mapper::recordOf(ObjectId id) const {
  const auto at = state_.records().find(id);
  return at == state_.records().end() || !at->second.confirmed ? nullptr : &at->second;
}

bool Mapper::holds(ObjectId id) const { return recordOf(id) != nullptr; }

/// Returns the transform and its error for objects of anchor `a`; nothing if the pose of `a`
/// relative to `here` is too uncertain.
std::optional<Recallable> Mapper::relativeTo(const Anchor& here, const Anchor& a) {
  const auto T_ba = marginals().to(a.id);
  const LoopParameters& loop = parameters_.loop;
  if (!T_ba || planeSigma(T_ba->covariance) > loop.hold_back_m ||
      T_ba->covariance(3, 3) > loop.hold_back_rad * loop.hold_back_rad) {
    return std::nullopt;
  }
  constexpr double kMoved_m = 1e-3, kMoved_rad = 1e-5;
  Recallable there;
  const RigidTransform T_now = here.T_WA * T_ba->mean.rigid() * a.T_WA.inverse();
  const bool moved =
      (T_now * a.T_WA.p - a.T_WA.p).norm() > kMoved_m || std::abs(yawOf(T_now.R())) > kMoved_rad;
  if (a.session != *session_ || moved) there.T_now = T_now;
  there.covariance = turnedBy(here.T_WA.R(), T_ba->covariance);
  there.about_W = here.T_WA * T_ba->mean.p;
  return there;
}

RigidTransform Mapper::T_MW() const {
  if (!builder_.last()) return {};
  const Anchor& here = *builder_.last();
  return state_.graph().pose(here.id).rigid() * here.T_WA.inverse();
}

std::optional<Mapper::Frame> Mapper::frame() {
  if (!builder_.last()) return std::nullopt;
  const auto components = componentsOf(state_.graph());
  const AnchorId first = components.at(builder_.last()->id);
  Frame frame;
  frame.map = state_.anchors().at(first).session;
  frame.T_MW = T_MW();
  const auto T_bM = marginals().to(first);
  const Eigen::Matrix3d R_M = state_.graph().pose(first).R();
  if (T_bM) frame.covariance = turnedBy(R_M, mapping::inverse(*T_bM).covariance);
  std::set<WorldId> sessions;
  for (const auto& [anchor, component] : components) {
    if (component == first) sessions.insert(state_.anchors().at(anchor).session);
  }
  frame.sessions = static_cast<std::uint32_t>(sessions.size());
  for (const auto& [id, edge] : state_.graph().edges()) {
    const bool believed = state_.graph().weight(id) >= kBelieved;
    if (edge.kind != EdgeKind::kOdometry && believed) ++frame.loops;
  }
  return frame;
}

std::vector<Mapper::Along> Mapper::along(const WorldId& session) const {
  std::vector<Along> result;
  for (const auto& [id, anchor] : state_.anchors()) {
    if (anchor.session != session) continue;
    result.push_back({anchor.stamp.time, state_.graph().pose(id).rigid() * anchor.T_WA.inverse()});
  }
  return result;
}

}  // namespace perdure::mapping
