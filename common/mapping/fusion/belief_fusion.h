// Fuses two beliefs about one object from two drives. The correlation of their errors is unknown.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// Fuses `host` and `guest`, which must be in one frame, with cross_pose zero. Cuboids of classes
/// in both beliefs are fused by covariance intersection. PMF and existence are pooled with the
/// weight of the most probable of these classes. The result has the earlier first_seen, the later
/// last_seen, and the larger hits of the two. Id, motion and ledger are those of `host`; the ledger
/// records the changes of existence and PMF as a merge.
ObjectBelief fused(const ObjectBelief& host, const ObjectBelief& guest);

/// A belief in the W of its session, and the mapper's record of the object.
struct Witness {
  const ObjectBelief& belief;
  const ObjectRecord& record;
  const Anchor& anchor;  ///< the anchor of record.sighting
};
/// Transforms `guest` by the relation of the two anchors, and fuses it with the belief of `host`
/// relative to the body. The result is in the host's W. It includes the host's pose error, and its
/// `cross_pose` refers to the `pose_error` in the host's record.
ObjectBelief fusedAcross(const Witness& host, const Witness& guest,
                         const LevelGaussian& T_host_guest);

/// Returns the belief relative to the body, in the axes of its anchor.
ObjectBelief inAnchor(const Witness& witness);

}  // namespace perdure::mapping
