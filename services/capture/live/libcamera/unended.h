// Object that libcamera still references.
#pragma once

namespace perdure::capture {

class Unended {
 public:
  virtual ~Unended() = default;
  /// Tries to end the object. It may be destroyed only after this returns true.
  virtual bool over() = 0;
};

}  // namespace perdure::capture
