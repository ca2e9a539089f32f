// Names the arithmetic of this machine. Machines with the same name round alike, so that the same
// code gives the same bytes on them. The name contains architecture, compiler, and a digest of
// results of libm, Eigen and OpenCV for fixed inputs, because these select kernels by the
// processor.
#pragma once

#include <string>

namespace perdure::test {

/// Returns "x86_64-gcc12.2.0-O-<digest>", for runs with numbers as inputs.
std::string arithmeticOfNumbers();
/// As above, with OpenCV's results on images and on small systems of equations.
std::string arithmeticOfPictures();

}  // namespace perdure::test
