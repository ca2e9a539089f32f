#include "common/bus/security/roles.h"

#include <array>

namespace perdure::bus {

std::span<const RoleName> roleNames() {
  static constexpr std::array<RoleName, 12> kNames{{{Role::kCapture, "capture"},
                                                    {Role::kVio, "vio"},
                                                    {Role::kInference, "inference"},
                                                    {Role::kSemanticFilter, "semantic_filter"},
                                                    {Role::kMapStore, "map_store"},
                                                    {Role::kRecord, "record"},
                                                    {Role::kOperator, "operator"},
                                                    {Role::kPlayer, "player"},
                                                    {Role::kSubscriber, "subscriber"},
                                                    {Role::kGateway, "gateway"},
                                                    {Role::kRos2, "ros2"},
                                                    {Role::kRos2Driver, "ros2_driver"}}};
  return kNames;
}

std::string identityOf(const std::string& process) {
  if (process == "black_box") return "record";
  if (process == "perdure play") return "player";
  if (process.starts_with("perdure ") || process == "demo") return "operator";
  return process;
}

}  // namespace perdure::bus
