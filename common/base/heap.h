// Heap settings for programs that repeat the same work for each frame.
#pragma once

namespace perdure {

/// Makes the process retain up to 64 MB of freed memory. By default glibc returns this memory and
/// requests it again within each frame, at one page fault per 4 kB. Call this function in main().
/// It has no effect without glibc.
void keepFreedMemory();

}  // namespace perdure
