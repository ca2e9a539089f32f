// The libFuzzer program. $PERDURE_FUZZ_TARGET names the target; without it, the program lists the
// names. $PERDURE_FUZZ_SEEDS is a folder into which the target's seeds are written.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/fuzz/target.h"

namespace {

using namespace perdure::fuzz;  // NOLINT

const Target* chosen = nullptr;

void writeSeeds(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  int number = 0;
  for (const Bytes& seed : chosen->seeds()) {
    std::ofstream(folder / ("seed-" + std::to_string(number++)), std::ios::binary)
        .write(reinterpret_cast<const char*>(seed.data()),
               static_cast<std::streamsize>(seed.size()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* name = std::getenv("PERDURE_FUZZ_TARGET");
  for (const Target& target : targets()) {
    if (name == nullptr) std::puts(target.name.c_str());
    if (name != nullptr && target.name == name) chosen = &target;
  }
  if (name == nullptr) std::exit(0);
  if (chosen == nullptr) {
    std::fprintf(stderr, "%s is no target\n", name);
    std::exit(64);
  }
  if (const char* seeds = std::getenv("PERDURE_FUZZ_SEEDS")) writeSeeds(seeds);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)chosen->take({data, size});
  return 0;
}
