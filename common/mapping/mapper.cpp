#include "common/mapping/mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

/// d(error of an object of B in A) by d(error of T_AB): it turns about B's origin.
Eigen::Matrix4d byFrame(const Eigen::Vector3d& arm_A) {
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J(0, 3) = -arm_A.y();
  J(1, 3) = arm_A.x();
  return J;
}

/// The object of B in A, with the error of T_AB.
PlacedObject laid(const LevelGaussian& T_AB, const PlacedObject& object) {
  PlacedObject o = transformed(T_AB.mean, object);
  const Eigen::Matrix4d J = byFrame(o.p - T_AB.mean.p);
  o.covariance += J * T_AB.covariance * J.transpose();
  return o;
}

/// A covariance of [p, yaw] in axes that R turns it into.
Eigen::Matrix4d turnedBy(const Eigen::Matrix3d& R, const Eigen::Matrix4d& covariance) {
  Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
  G.topLeftCorner<3, 3>() = R;
  return G * covariance * G.transpose();
}

std::set<std::pair<ObjectId, ObjectId>> pairsOf(const PlaceMatch& match) {
  return {match.pairs.begin(), match.pairs.end()};
}

double planeSigma(const Eigen::Matrix4d& covariance) {
  return std::sqrt(covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
}

}  // namespace

Mapper::Mapper(const Parameters& parameters)
    : parameters_(parameters),
      builder_(parameters.anchor),
      graph_(parameters.graph),
      drift_scale_(parameters.drift_scale) {}

void Mapper::begin(const Odometry& odometry) {
  session_ = odometry.world;
  builder_ = AnchorBuilder(parameters_.anchor);
  searched_at_m_ = learned_at_m_ = 0.0;
  active_.reset();
}

void Mapper::onOdometry(const Odometry& odometry) {
  if (odometry.state == OdometryState::kInitialising) return;
  if (session_ != odometry.world) begin(odometry);
  const auto anchor = builder_.add(odometry, next_anchor_);
  if (!anchor) return;
  ++next_anchor_;
  anchors_[anchor->id] = *anchor;
  if (anchor->previous == 0) {
    const LevelPose T_WA =
        levelOf(levelled(RigidTransform(), odometry.up_W).inverse() * anchor->T_WA);
    graph_.addFirst(anchor->id, T_WA);
  } else {
    LevelGaussian increment = anchor->from_previous;
    increment.covariance *= odometry_variance_;
    graph_.add(anchor->id, anchor->previous, increment);
  }
  marginals_.reset();
}

std::uint32_t Mapper::numberOf(const std::string& class_name) {
  return class_numbers_.try_emplace(class_name, class_numbers_.size()).first->second;
}

/// Given the pose: what the pose error explains of the covariance is not the object's.
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
    o.pmf.push_back({numberOf(c.name), c.probability});
  }
  return o;
}

bool Mapper::isOld(const Record& record) const {
  return record.session != *session_ || builder_.way_m() - record.way_m > parameters_.loop.visit_m;
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

  auto [at, is_new] = records_.try_emplace(belief.id);
  Record& record = at->second;
  if (!is_new && isOld(record)) {
    record.earlier = record.sighting;
  }
  record.session = *session_;
  record.way_m = builder_.way_m();
  record.last_seen = belief.last_seen;
  record.confirmed = record.confirmed || belief.confirmed;
  record.pose_error = objects.pose_error;
  record.sighting = {anchor.id, std::move(o)};
}

void Mapper::onObjects(const Objects& objects) {
  if (!session_ || objects.world != *session_ || !builder_.last()) return;
  for (const ObjectBelief& belief : objects.objects) {
    if (belief.moving > 0.5 || belief.classes.empty()) continue;
    if (!belief.confirmed && (belief.existence < 0.5 || belief.hits < 2)) continue;
    const auto known = records_.find(belief.id);
    if (belief.recalled || (known != records_.end() && belief.last_seen <= known->second.last_seen))
      continue;
    see(belief, objects);
  }
  if (builder_.way_m() - searched_at_m_ < parameters_.loop.search_each_m) return;
  std::erase_if(records_, [&](const auto& r) { return !r.second.confirmed && isOld(r.second); });
  searched_at_m_ = builder_.way_m();
  search();
}

void Mapper::onMerged(ObjectId survivor, ObjectId absorbed) {
  const auto from = records_.find(absorbed);
  if (from == records_.end()) return;
  auto [into, is_new] = records_.try_emplace(survivor, from->second);
  if (!is_new) {
    // What is seen now is seen of the survivor.
    Record& record = into->second;
    const bool confirmed = record.confirmed || from->second.confirmed;
    if (from->second.last_seen >= record.last_seen) {
      const bool came_back = isOld(record);
      Record merged = from->second;
      if (came_back) merged.earlier = record.sighting;
      if (!came_back && !merged.earlier) merged.earlier = record.earlier;
      record = std::move(merged);
    }
    record.confirmed = confirmed;
  }
  into->second.sighting.in_anchor.id = survivor;
  if (into->second.earlier) into->second.earlier->in_anchor.id = survivor;
  records_.erase(absorbed);
}

void Mapper::onGone(ObjectId id) { records_.erase(id); }

PlacedObject Mapper::inM(const Sighting& sighting) const {
  return transformed(graph_.pose(sighting.anchor), sighting.in_anchor);
}

const Marginals& Mapper::marginals() {
  if (!marginals_) marginals_ = std::make_unique<Marginals>(graph_, builder_.last()->id);
  return *marginals_;
}

/// What was detected on the way of late, in the body's newest anchor: without what is known to have
/// been seen before.
std::vector<PlacedObject> Mapper::seenOfLate() {
  std::vector<PlacedObject> seen;
  bool fresh = false;
  for (const auto& [id, record] : records_) {
    const double ago_m = builder_.way_m() - record.way_m;
    if (isOld(record) || record.earlier) continue;
    const auto T_bA = marginals().to(record.sighting.anchor);
    if (!T_bA) continue;
    seen.push_back(laid(*T_bA, record.sighting.in_anchor));
    fresh = fresh || ago_m < parameters_.loop.fresh_m;
  }
  if (!fresh) seen.clear();
  return seen;
}

/// Adds what the map has around, and returns how well its nearest place is known relative to the
/// body, T_ba. Nothing where no earlier visit came past.
std::optional<LevelGaussian> Mapper::addMapAround(PlaceQuery& query) {
  std::optional<LevelGaussian> nearest;
  double nearest_m = std::numeric_limits<double>::infinity();
  std::set<AnchorId> around;
  for (const auto& [id, anchor] : anchors_) {
    const bool of_this_visit =
        anchor.session == *session_ && builder_.way_m() - anchor.way_m < parameters_.loop.visit_m;
    if (of_this_visit) continue;
    const auto T_ba = marginals().to(id);
    if (!T_ba) continue;
    const double distance = T_ba->mean.p.head<2>().norm();
    const double sigma = planeSigma(T_ba->covariance);
    if (distance > parameters_.loop.view_m + parameters_.place.gate_sigmas * sigma) continue;
    around.insert(id);
    query.driven.push_back(graph_.pose(id).p.head<2>());
    if (distance - sigma < nearest_m) {
      nearest_m = distance - sigma;
      nearest = T_ba;
    }
  }
  for (const auto& [id, record] : records_) {
    const Sighting* known = sightingOfBefore(record);
    if (record.confirmed && known != nullptr && around.contains(known->anchor)) {
      query.map.push_back(inM(*known));
    }
  }
  return nearest;
}

/// What is known of an object from before this visit.
const Mapper::Sighting* Mapper::sightingOfBefore(const Record& record) const {
  if (isOld(record)) return &record.sighting;
  return record.earlier ? &*record.earlier : nullptr;
}

/// Looks for the body among the objects of earlier visits.
void Mapper::search() {
  PlaceQuery query;
  query.seen = seenOfLate();
  if (query.seen.empty()) return;
  const auto T_ba = addMapAround(query);
  if (!T_ba || query.map.empty()) return;
  // T_Mb as the earlier anchors see it: their own errors in M do not count.
  query.prior.mean = graph_.pose(builder_.last()->id);
  query.prior.covariance =
      turnedBy((query.prior.mean * T_ba->mean).R(), mapping::inverse(*T_ba).covariance);
  query.prior.covariance.diagonal().head<3>().array() += std::pow(parameters_.loop.floor_m, 2);
  query.prior.covariance(3, 3) += std::pow(parameters_.loop.floor_rad, 2);
  const LevelGaussian prior = query.prior;
  const auto match = bestMatch(std::move(query), parameters_.place);
  if (!match || !isBelieved(*match, planeSigma(T_ba->covariance))) return;
  if (active_ && active_->pairs == pairsOf(*match)) return;  // nothing new
  close(*match, prior);
}

/// Where the body is known well, what is asked is only which object is which.
bool Mapper::isBelieved(const PlaceMatch& match, double sigma_m) const {
  const LoopParameters& loop = parameters_.loop;
  const bool near = sigma_m < loop.near_m;
  const std::size_t least = near ? 1 : sigma_m < loop.far_m ? 2 : 4;
  const double nats = near ? loop.near_nats : loop.nats;
  return match.pairs.size() >= least && match.score - match.next >= nats + std::log(match.cells);
}

void Mapper::learnDrift(const PlaceMatch& match, const LevelGaussian& prior) {
  if (builder_.way_m() - learned_at_m_ < parameters_.loop.view_m) return;
  learned_at_m_ = builder_.way_m();
  Eigen::Matrix4d measured = match.T_MB.covariance;
  measured.diagonal().head<3>().array() += std::pow(parameters_.loop.floor_m, 2);
  measured(3, 3) += std::pow(parameters_.loop.floor_rad, 2);
  drift_scale_.add(difference(match.T_MB.mean, prior.mean), measured,
                   prior.covariance / odometry_variance_);
  const double variance = drift_scale_.variance();
  graph_.scaleOdometry(variance / odometry_variance_);
  odometry_variance_ = variance;
}

void Mapper::close(const PlaceMatch& match, const LevelGaussian& prior) {
  learnDrift(match, prior);
  const AnchorId b = builder_.last()->id;
  // The edge begins at the anchor that most of the matched objects belong to.
  std::map<AnchorId, std::size_t> homes;
  for (const auto& [known, seen] : match.pairs) {
    ++homes[sightingOfBefore(records_.at(known))->anchor];
  }
  const AnchorId a = std::max_element(homes.begin(), homes.end(), [](const auto& x, const auto& y) {
                       return x.second < y.second;
                     })->first;
  const Edge edge = edgeFrom(a, b, match.T_MB, EdgeKind::kLoop);
  const LevelPose before = graph_.pose(b);
  const bool rests_on_the_same =
      active_ && std::any_of(match.pairs.begin(), match.pairs.end(),
                             [&](const auto& pair) { return active_->pairs.contains(pair); });
  if (rests_on_the_same) graph_.remove(active_->id);
  const EdgeId id = graph_.add(edge);
  active_ = {id, pairsOf(match)};
  optimise();
  change_.loops.push_back({id, a, b, match, (graph_.pose(b).p - before.p).norm()});
  for (const auto& [known, seen] : match.pairs) {
    if (known != seen) change_.merges.push_back({id, known, seen});
  }
}

/// The measured T_Mb as an edge. What M says of a is not a part of its error.
Edge Mapper::edgeFrom(AnchorId a, AnchorId b, const LevelGaussian& T_Mb, EdgeKind kind) const {
  Edge edge{a, b, {}, kind};
  const LevelPose T_Ma = graph_.pose(a);
  edge.T_ab.mean = T_Ma.inverse() * T_Mb.mean;
  edge.T_ab.covariance = turnedBy(T_Ma.R().transpose(), T_Mb.covariance);
  edge.T_ab.covariance.diagonal().head<3>().array() += std::pow(parameters_.loop.floor_m, 2);
  edge.T_ab.covariance(3, 3) += std::pow(parameters_.loop.floor_rad, 2);
  return edge;
}

void Mapper::optimise() {
  (void)graph_.optimise();
  marginals_.reset();
  ++revision_;
}

std::vector<Recallable> Mapper::near(const Eigen::Vector3d& centre_W, double radius_m) {
  std::vector<Recallable> result;
  if (!builder_.last()) return result;
  const Anchor& here = *builder_.last();
  const Eigen::Vector3d centre_M = graph_.pose(here.id) * (here.T_WA.inverse() * centre_W);
  std::map<AnchorId, std::optional<Recallable>> by_anchor;
  for (const auto& [id, record] : records_) {
    const Eigen::Vector3d p_M = graph_.pose(record.sighting.anchor) * record.sighting.in_anchor.p;
    if (!record.confirmed || (p_M - centre_M).norm() > radius_m) continue;
    const auto [at, is_new] = by_anchor.try_emplace(record.sighting.anchor);
    if (is_new) at->second = relativeTo(here, anchors_.at(record.sighting.anchor));
    if (!at->second) continue;
    result.push_back(*at->second);
    result.back().id = id;
    result.back().pose_error = record.pose_error;
  }
  return result;
}

bool Mapper::holds(ObjectId id) const {
  const auto at = records_.find(id);
  return at != records_.end() && at->second.confirmed;
}

/// How what belongs to anchor `a` is laid beside `here`; nothing where that is not known well.
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
  return graph_.pose(here.id).rigid() * here.T_WA.inverse();
}

std::vector<Mapper::Along> Mapper::along(const WorldId& session) const {
  std::vector<Along> result;
  for (const auto& [id, anchor] : anchors_) {
    if (anchor.session != session) continue;
    result.push_back({anchor.stamp.time, graph_.pose(id).rigid() * anchor.T_WA.inverse()});
  }
  return result;
}

}  // namespace perdure::mapping
