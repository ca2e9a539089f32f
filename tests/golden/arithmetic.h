// What this machine's arithmetic is called: machines of one name round alike, so that the same code
// gives the same bytes on them. The name holds architecture and compiler, and a digest of what
// libm, Eigen and OpenCV make of fixed inputs, for which they choose kernels by the processor.
#pragma once

#include <string>

namespace perdure::test {

/// "x86_64-gcc12.2.0-O-<digest>": of runs whose inputs are numbers.
std::string arithmeticOfNumbers();
/// The same with what OpenCV makes of pictures and of small systems of equations.
std::string arithmeticOfPictures();

}  // namespace perdure::test
