// Fuses two beliefs about one object, from drives whose errors have an unknown correlation.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// `host` and `guest` are in one frame and independent of the body's pose (cross_pose zero).
/// Cuboids of classes in both beliefs are fused by covariance intersection. PMF and existence are
/// pooled with the weight of the most probable of these classes. The first sighting is the earlier,
/// the last sighting the later, and hits the larger of the two. Id, motion and ledger are those of
/// `host`; the ledger records the difference as a merge.
ObjectBelief fused(const ObjectBelief& host, const ObjectBelief& guest);

/// A belief in its session's W, with the mapper's record of the object.
struct Witness {
  const ObjectBelief& belief;
  const ObjectRecord& record;
  const Anchor& anchor;  ///< the anchor of record.sighting
};
/// Transforms `guest` by the relation of the two anchors, and fuses it with the belief of `host`
/// relative to the body. The result is in the host's W, with the host's pose error: `cross_pose`
/// still refers to the `pose_error` of its record.
ObjectBelief fusedAcross(const Witness& host, const Witness& guest,
                         const LevelGaussian& T_host_guest);

/// The belief relative to the body, in the axes of its anchor.
ObjectBelief inAnchor(const Witness& witness);

}  // namespace perdure::mapping
