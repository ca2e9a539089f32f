// Last call to an object on a thread of libcamera.
#pragma once

#include <libcamera/base/object.h>

namespace perdure::capture {

/// Calls `leave` and then `end` on the object's thread, and returns the result of `end`. Earlier
/// messages of that thread are processed first. Messages that these post in turn are also processed
/// first, for example by queueRequest(); libcamera processes them later, with raw pointers. After
/// `leave`, the object must not post messages.
template <class T, class Answer>
Answer lastOfAll(T& object, void (T::*leave)(), Answer (T::*end)()) {
  object.invokeMethod(leave, libcamera::ConnectionTypeBlocking);
  return object.invokeMethod(end, libcamera::ConnectionTypeBlocking);
}

}  // namespace perdure::capture
