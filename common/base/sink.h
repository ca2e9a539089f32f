// Where a node puts its results: DDS in a service, a neighbour or a file in one process.
#pragma once

#include <functional>

namespace perdure {

template <class T>
using Sink = std::function<void(const T&)>;

}  // namespace perdure
