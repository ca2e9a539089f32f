// What leaves the working set of the node for the map, and what comes back from there.
#include <algorithm>
#include <set>

#include "services/semantic_filter/core/context.h"
#include "services/semantic_filter/node.h"

namespace perdure::semantic_filter {
namespace {

constexpr std::uint32_t kMostRecalled = 1000;  // by one answer

void eraseFrom(std::vector<Object>& objects, const std::set<ObjectId>& ids) {
  std::erase_if(objects, [&](const Object& o) { return ids.contains(o.id); });
}

}  // namespace

/// What leaves was seen in no frame that may be stepped again, and leaves those too: a late
/// detection does not bring it back.
void Node::letGo(const Entry& entry) {
  const TimePoint now = entry.input.stamp.time, oldest = history_.front().input.stamp.time;
  const auto leaving = long_term_.leaving(belief_.objects, entry.input.view.T_WB.p, now, oldest);
  if (leaving.archived.empty() && leaving.forgotten.empty()) return;
  std::set<ObjectId> ids(leaving.archived.begin(), leaving.archived.end());
  for (const Object& o : belief_.objects) {
    if (!ids.contains(o.id)) continue;
    long_term_.rememberProduct(o);
    events_.archived(o.id);
  }
  ids.insert(leaving.forgotten.begin(), leaving.forgotten.end());
  eraseFrom(belief_.objects, ids);
  for (Entry& e : history_) eraseFrom(e.before.objects, ids);
}

void Node::askTheMap(const Entry& entry) {
  if (!outputs_.queries) return;
  const auto question = long_term_.ask(entry.input.view.T_WB.p, entry.input.stamp.time);
  if (const auto count = long_term_.takeUnanswered()) reasons_.add("map_store_silent", count);
  if (!question) return;
  MapQuery query;
  query.client = instance_;
  query.request = question->request;
  query.kind = MapQueryKind::kRecall;
  query.low = question->centre_W;
  query.radius = question->radius_m;
  query.world = entry.world;
  query.limit = kMostRecalled;
  outputs_.queries(query);
}

/// Into the newest belief and those that late detections may go back to, in order of id.
void Node::insert(const Object& object) {
  const auto into = [&](Belief& b) {
    const auto at = std::find_if(b.objects.begin(), b.objects.end(),
                                 [&](const Object& o) { return o.id > object.id; });
    b.objects.insert(at, object);
  };
  into(belief_);
  for (auto& entry : history_) into(entry.before);
}

void Node::restore(const ObjectBelief& belief) {
  insert(fromBelief(belief, pose_error_.product, ExistenceEvidence::kRestore));
  events_.recalled(belief.id, true);
}

void Node::recall(const ObjectBelief& belief) {
  if (belief.moving > 0.5) return reasons_.add("recalled_moving");
  if (last_T_WB_ && !long_term_.near(belief.best().mean.head<3>(), last_T_WB_->p)) return;
  const auto product = long_term_.productAt(belief.as_of);
  Object object =
      fromBelief(belief, product.value_or(pose_error_.product), ExistenceEvidence::kRecall);
  if (!product) {  // of another run: how its error hangs together with this one's is not known
    for (auto& h : object.hypotheses) h.C.setZero();
  }
  insert(object);
  events_.recalled(belief.id, false);
}

void Node::insertRecalled(const Recalled& recalled) {
  ids_.atLeast(recalled.next_id);
  for (auto belief : recalled.objects) {
    if (belief.classes.empty() || belief.id == 0) {
      reasons_.add("recalled_malformed");
      continue;
    }
    ids_.atLeast(belief.id + 1);
    const auto same = [&](const Object& o) { return o.id == belief.id; };
    if (std::any_of(belief_.objects.begin(), belief_.objects.end(), same)) continue;
    removeContext(belief);
    recalled.restore ? restore(belief) : recall(belief);
  }
}

void Node::onRecalled(const Recalled& recalled) {
  const bool for_all = recalled.client == 0 && !recalled.restore;
  if (recalled.client != instance_ && !for_all) return;
  ids_.atLeast(recalled.next_id);
  if (!world_) {
    waiting_recalled_ = recalled;
    return;
  }
  if (recalled.world != *world_) return reasons_.add("recalled_of_other_world");
  const bool asked = recalled.restore || for_all;
  if (!asked && !long_term_.answered(recalled.request, recalled.kept, recalled.truncated)) {
    return reasons_.add("recalled_unasked");
  }
  insertRecalled(recalled);
}

}  // namespace perdure::semantic_filter
