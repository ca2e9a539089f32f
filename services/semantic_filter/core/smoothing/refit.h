// The verb "smooth": an object's hypotheses again from all its remembered looks; which mode of yaw
// it is, and whether it moves.
#pragma once

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"

namespace perdure::semantic_filter {

/// Remembers this box of the object's where it shows something new. Whether the object is then to
/// be smoothed.
bool rememberLook(Object& object, const Evidence& box, const std::array<bool, 4>& hidden,
                  const FrameContext& frame);
/// How much there is to gain, where `fresh` is the share of new looks that is waited for: 1 and
/// more is worth it.
double smoothingNeed(const Object& object, double fresh);
/// What the fit of a thing leaves over of its looks.
struct Leftovers {
  Leftover sides, azimuths;
};
/// Smooths the object's hypotheses and weighs within each class whether it moves. Of a thing that
/// surely stands, what is left over of the looks that are new.
std::optional<Leftovers> smooth(Object& object, const FrameContext& frame);

/// Smooths the objects that need it most: as many as a frame has time for; the others wait.
void smoothNeediest(std::vector<Object*>& objects, Belief& belief, const FrameContext& frame);

}  // namespace perdure::semantic_filter
