// Destination of a node's results: DDS in a service; another node or a file within one process.
#pragma once

#include <functional>

namespace perdure {

template <class T>
using Sink = std::function<void(const T&)>;

}  // namespace perdure
