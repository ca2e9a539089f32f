// Tests that speak DDS run beside each other: each in a network namespace of its own where the
// system allows it, else in a domain that no other test holds.
#pragma once

namespace perdure::tests {

/// Call it first in main or in a test environment, while there is one thread. Children inherit it.
void isolateNetwork();

}  // namespace perdure::tests
