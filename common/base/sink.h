// The destination of a node's results: DDS in a service, or another node or a file in a program
// that runs several nodes.
#pragma once

#include <functional>

namespace perdure {

template <class T>
using Sink = std::function<void(const T&)>;

}  // namespace perdure
