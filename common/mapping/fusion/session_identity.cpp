#include "common/mapping/fusion/session_identity.h"

#include <algorithm>
#include <bit>
#include <string>

namespace perdure::mapping {
namespace {

class Bits {
 public:
  void add(std::uint64_t value) {
    for (int byte = 0; byte < 8; ++byte) text_.push_back(static_cast<char>(value >> (8 * byte)));
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const Eigen::Vector3d& v) {
    for (const double each : v) add(each);
  }
  std::uint64_t digest() const { return perdure::digest(text_); }

 private:
  std::string text_;
};

/// Adds an anchor to the digest, without its covariances, because loops rescale them.
void add(Bits& bits, const Anchor& anchor) {
  bits.add(anchor.stamp.source);
  bits.add(anchor.stamp.sequence);
  bits.add(static_cast<std::uint64_t>(toNanoseconds(anchor.stamp.time)));
  bits.add(anchor.T_WA.p);
  for (const double each : anchor.T_WA.q.coeffs()) bits.add(each);
  if (anchor.previous == 0) return;
  bits.add(anchor.from_previous.mean.p);
  bits.add(anchor.from_previous.mean.yaw);
}

SessionIdentity identityOf(const std::vector<AnchorId>& way, const SavedMap& map) {
  Bits bits;
  SessionIdentity identity;
  add(bits, map.anchors.at(way.front()).anchor);
  identity.first = bits.digest();
  if (way.size() == 1) return identity;
  add(bits, map.anchors.at(way[1]).anchor);
  identity.second = bits.digest();
  return identity;
}

}  // namespace

std::vector<Session> sessionsOf(const SavedMap& map) {
  std::vector<Session> sessions;
  std::map<WorldId, std::size_t> places;
  for (const auto& [id, saved] : map.anchors) {
    const auto [at, is_new] = places.try_emplace(saved.anchor.session, sessions.size());
    if (is_new) sessions.push_back({saved.anchor.session, {}, {}});
    sessions[at->second].anchors.push_back(id);
  }
  for (Session& session : sessions) session.identity = identityOf(session.anchors, map);
  return sessions;
}

const Session* find(const std::vector<Session>& sessions, const SessionIdentity& identity) {
  const auto at = std::find_if(sessions.begin(), sessions.end(), [&](const Session& session) {
    return session.identity.matches(identity);
  });
  return at == sessions.end() ? nullptr : &*at;
}

}  // namespace perdure::mapping
