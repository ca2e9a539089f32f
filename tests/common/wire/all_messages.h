// The messages of all topics, for typed tests.
#pragma once

#include <gtest/gtest.h>

#include "common/wire/topics.h"

namespace perdure::wire {

template <class Rows>
struct MessagesOf;
template <class... Rows>
struct MessagesOf<std::tuple<Rows...>> {
  using Types = testing::Types<typename Rows::Message...>;
};
using AllMessages = MessagesOf<Topics>::Types;

}  // namespace perdure::wire
