// The part of the folder that is not drawn: writeSensors of writer.h.
#include "tools/simulate/writer.h"

namespace perdure::tools {

void writeSensors(const std::filesystem::path& folder, const sim::Scene& scene) {
  sim::writeObjectsTruth(folder, sim::truthOf(scene, kSceneEpoch));
}

}  // namespace perdure::tools
