#include "tests/fuzz/target.h"

#include "common/base/errors.h"

namespace perdure::fuzz {

const std::vector<Target>& targets() {
  static const std::vector<Target> all = [] {
    std::vector<Target> list;
    for (const auto& group : {textTargets(), folderTargets(), settingTargets(), binaryTargets(),
                              gatewayTargets(), mapTargets(), rosTargets(), vehicleTargets()}) {
      list.insert(list.end(), group.begin(), group.end());
    }
    return list;
  }();
  return all;
}

bool unlessRefused(const std::function<void()>& read) {
  try {
    read();
  } catch (const StartupError& error) {
    require(*error.what() != '\0', "a refusal says why");
    return false;
  }
  return true;
}

}  // namespace perdure::fuzz
