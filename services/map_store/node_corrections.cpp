// The node's functions for corrections by people.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "services/map_store/node.h"

namespace perdure::map_store {
namespace {

Correction* findCorrection(std::vector<Correction>& corrections, std::uint64_t id) {
  const auto at = std::ranges::find(corrections, id, &Correction::id);
  return at == corrections.end() ? nullptr : &*at;
}

/// Whether a standing correction is the statement of another one.
bool saysTheSame(Correction standing, const Correction& other) {
  standing.id = other.id;
  standing.time = other.time;
  return standing == other;
}

}  // namespace

bool Node::isKnown(ObjectId id) {
  if (mapper_.identity().isShared(id)) return true;
  const auto place = database_.reader().placeOf(id);
  return place && *place;
}

/// Returns the reason why a statement about two objects cannot be used; empty if it can be.
std::string Node::faultOfPair(const Correction& correction) const {
  if (correction.object == correction.other) {
    return fmt::format("object {} is given twice; give the ids of two objects", correction.object);
  }
  if (correction.kind == CorrectionKind::kSame) return {};
  const mapping::Identity merges(mapper_.identity().mergesByFilter());
  if (merges.objectOf(correction.object) != merges.objectOf(correction.other)) return {};
  return fmt::format(
      "the filter merged {} and {} into one track, which cannot be divided; state not_there if the "
      "object is wrong",
      correction.object, correction.other);
}

std::string Node::faultOfNew(const Correction& correction) {
  for (const ObjectId id : {correction.object, correction.other}) {
    if (id == correction.other && !correction.aboutTwo()) continue;
    if (!isKnown(id)) {
      return fmt::format("the map has no object {}; `perdure map list` shows those it has", id);
    }
  }
  if (correction.aboutTwo()) return faultOfPair(correction);
  if (correction.kind != CorrectionKind::kClass) return {};
  const auto classes = database_.reader().classes();
  if (!classes || classes->contains(correction.class_name)) return {};
  return fmt::format("no object of the map ever had the class '{}'; its classes are: {}",
                     correction.class_name, fmt::join(*classes, ", "));
}

/// Completes a request: fills in the values that the map determines. Returns why it is refused;
/// empty if it is accepted.
std::string Node::completed(Correction& correction) {
  std::vector<Correction> all = mapper_.identity().corrections();
  if (!newest_) return "the map is empty";
  if (correction.withdrawn) {
    const Correction* known = findCorrection(all, correction.id);
    if (known == nullptr || known->withdrawn) {
      return fmt::format("no correction {} stands; `perdure map correct --list` shows them",
                         correction.id);
    }
    correction = *known;
    correction.withdrawn = true;
    return {};
  }
  if (correction.nats == 0.0) correction.nats = config_.correction_nats;
  if (!correction.aboutTwo()) correction.other = 0;
  correction.id = all.empty() ? 1 : all.back().id + 1;
  correction.time = newest_->stamp.time;
  // The same statement again: its answer was lost, or somebody insists.
  for (const Correction& known : all) {
    if (saysTheSame(known, correction)) correction = known;
  }
  const auto standing = std::ranges::count(all, false, &Correction::withdrawn);
  if (std::cmp_greater_equal(standing, kMostCorrections)) {
    return fmt::format("the map has {} corrections, which is the limit", standing);
  }
  return faultOfNew(correction);
}

void Node::onCorrection(const MapCorrection& request) {
  if (const MapReply* again = replies_.find(request.client, request.request)) {
    return outputs_.reply(*again);
  }
  MapReply reply = emptyReply(request.client, request.request);
  Correction correction = request.correction;
  reply.error = completed(correction);
  if (reply.error.empty()) {
    corrected_.insert({correction.object, mapper_.identity().objectOf(correction.object)});
    mapper_.onCorrection(correction);
    corrected_.insert(mapper_.identity().objectOf(correction.object));
    reasons_.add(correction.withdrawn ? "corrections_withdrawn" : "corrections");
    dirty_ = true;
    commit();
    if (dirty_) reply.error = failure_ + " The correction is written when that is possible.";
  } else {
    reasons_.add("correction_refused");
  }
  reply.ok = reply.error.empty();
  if (reply.ok) reply.corrections.push_back(std::move(correction));
  outputs_.reply(reply);
  replies_.keep(std::move(reply));
}

/// Passes the corrections to the published map, by present objects.
void Node::publishCorrections() {
  const mapping::Identity& identity = mapper_.identity();
  if (identity.corrections().empty()) return;
  database_.setCorrections(
      standingByObject(identity.corrections(), [&](ObjectId id) { return identity.objectOf(id); }));
}

/// Adds the corrections of objects in the message and in the working set, by the objects of the
/// filter: those without the kSame corrections.
void Node::addCorrections(MapNear& near) const {
  const mapping::Identity& identity = mapper_.identity();
  if (identity.corrections().empty()) return;
  std::set<ObjectId> here;
  for (const auto* list : {&near.placed, &near.as_published}) {
    for (const ObjectBelief& belief : *list) here.insert(identity.objectOf(belief.trackId()));
  }
  if (newest_) {
    for (const ObjectBelief& belief : newest_->objects) here.insert(identity.objectOf(belief.id));
  }
  for (Correction each : identity.corrections()) {
    const bool is_used = !each.withdrawn && each.kind != CorrectionKind::kDifferent;
    if (!is_used || !here.contains(identity.objectOf(each.object))) continue;
    const bool outweighed = each.kind == CorrectionKind::kSame &&
                            identity.objectOf(each.object) != identity.objectOf(each.other);
    if (outweighed) continue;
    each.object = identity.observedObjectOf(each.object);
    each.other = identity.observedObjectOf(each.other);
    near.corrections.push_back(std::move(each));
  }
}

}  // namespace perdure::map_store
