// What a program that does the same work for each frame wants of the heap.
#pragma once

namespace perdure {

/// Memory that was freed stays with the process (up to 64 MB of it): by default glibc gives it back
/// and asks for it again within each frame, a page fault for each 4 kB. For main(); elsewhere than
/// with glibc it does nothing.
void keepFreedMemory();

}  // namespace perdure
