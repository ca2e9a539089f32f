// What libcamera cannot let go of yet.
#pragma once

namespace perdure::capture {

class Unended {
 public:
  virtual ~Unended() = default;
  /// Tries to end it. Once it is true it may be destroyed, and not before.
  virtual bool over() = 0;
};

}  // namespace perdure::capture
