// Last call to an object on a thread of libcamera.
#pragma once

#include <libcamera/base/object.h>

namespace perdure::capture {

/// Calls `leave` and `end` on the object's thread, after all of its earlier messages and those that
/// they post (queueRequest()). Returns the result of `end`.
template <class T, class Answer>
Answer lastOfAll(T& object, void (T::*leave)(), Answer (T::*end)()) {
  object.invokeMethod(leave, libcamera::ConnectionTypeBlocking);
  return object.invokeMethod(end, libcamera::ConnectionTypeBlocking);
}

}  // namespace perdure::capture
