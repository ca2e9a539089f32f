// Common parts of several message families, described as in describe.h.
#pragma once

#include <concepts>

#include "common/wire/description/bounds.h"
#include "common/wire/description/types.h"

namespace perdure::wire {

template <class D, class T>
concept Is = std::same_as<std::remove_cv_t<D>, T>;

template <class A, Is<FrameStamp> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("source", d.source, w.source);
  a.value("sequence", d.sequence, w.seq);
  a.time("time_ns", d.time, w.time_ns);
  a.value("captured_ns", d.captured_ns, w.captured_ns);
  a.ensure("captured_ns", "out_of_range", [&] { return isTime(d.captured_ns); });
}

template <class A, Is<WorldId> D, class W>
void describe(A& a, D& d, W& w) {
  a.value("world", d.world, w.world);
  a.value("epoch", d.epoch, w.epoch);
}

template <class A, class D, class W>
void describeBox(A& a, D& d, W& w) {
  a.number("x1", d.x1, w[0], kPixel);
  a.number("y1", d.y1, w[1], kPixel);
  a.number("x2", d.x2, w[2], kPixel);
  a.number("y2", d.y2, w[3], kPixel);
  a.ensure("box", "out_of_range", [&] { return d.x1 < d.x2 && d.y1 < d.y2; });
}

}  // namespace perdure::wire
