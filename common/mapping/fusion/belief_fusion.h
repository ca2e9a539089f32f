// Two beliefs about one object, from drives whose errors are correlated in an unknown way, as one.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include "common/mapping/frames/relative_error.h"  // Matrix6d, for saved_map.h
#include "common/mapping/saved_map.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// `host` and `guest` are in one frame and independent of the body's pose (cross_pose zero).
/// Cuboids of the classes that both consider are intersected; PMF and existence are pooled with the
/// weight of the likeliest of these. First seen is the earlier, last seen the later, hits the
/// larger; id, motion and the ledger are those of `host`, with the difference entered as a merge.
ObjectBelief fused(const ObjectBelief& host, const ObjectBelief& guest);

/// A belief in its session's W, and what the mapper knows of the object.
struct Witness {
  const ObjectBelief& belief;
  const ObjectRecord& record;
  const Anchor& anchor;  ///< of record.sighting
};
/// `guest` is laid by the relation of the two anchors and fused with what is known of `host`
/// relative to the body. The result is in the host's W, with the host's error of the pose: its
/// record's `pose_error` remains what `cross_pose` refers to.
ObjectBelief fusedAcross(const Witness& host, const Witness& guest,
                         const LevelGaussian& T_host_guest);

/// The belief relative to the body, in axes of its anchor.
ObjectBelief inAnchor(const Witness& witness);

}  // namespace perdure::mapping
