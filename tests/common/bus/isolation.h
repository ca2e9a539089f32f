// Isolates tests that use DDS from each other. Each gets its own network namespace if the system
// allows it, or else a domain that no other test uses.
#pragma once

namespace perdure::tests {

/// Must be called first in main or in a test environment, while there is only one thread. Child
/// processes inherit the isolation.
void isolateNetwork();

}  // namespace perdure::tests
