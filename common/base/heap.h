// Heap settings for programs that repeat the same work for each frame.
#pragma once

namespace perdure {

/// Makes the process retain up to 64 MB of freed memory (glibc), which otherwise is returned and
/// requested again within each frame. Call it in main().
void keepFreedMemory();

}  // namespace perdure
