// The last call to an object that lives on a thread of libcamera's.
#pragma once

#include <libcamera/base/object.h>

namespace perdure::capture {

/// Calls `leave` and then `end` on the object's thread, and returns what `end` does. What that
/// thread was asked before comes first, and also what it then asks of itself, as by queueRequest():
/// libcamera only takes that up some time later, with bare pointers. From `leave` on the object is
/// to ask for no more.
template <class T, class Answer>
Answer lastOfAll(T& object, void (T::*leave)(), Answer (T::*end)()) {
  object.invokeMethod(leave, libcamera::ConnectionTypeBlocking);
  return object.invokeMethod(end, libcamera::ConnectionTypeBlocking);
}

}  // namespace perdure::capture
