#include "common/bus/topics.h"

#include <array>
#include <tuple>

namespace perdure::bus {
namespace {

using enum wire::Role;
constexpr Roles kWatchers =
    kRecord | kOperator | kGateway | kRos2 | kRos2Driver;  // read all topics

}  // namespace

std::string TopicInfo::typeName() const { return type->m_typename; }

std::span<const TopicInfo> topicTable() {
  static const auto table = std::apply(
      [](const auto&... row) {
        return std::array{TopicInfo{row.name, &row.descriptor(), row.qos, row.rate_hz, row.recorded,
                                    row.writers | kPlayer, row.readers | kWatchers}...};
      },
      wire::table::kRows);
  return table;
}

const TopicInfo* findTopic(std::string_view name) {
  for (const TopicInfo& info : topicTable()) {
    if (isRowOf(info.name, name)) return &info;
  }
  return nullptr;
}

double expectedRate(const TopicInfo& info, double camera_hz, double imu_hz) {
  if (info.rate_hz == wire::table::kCameraHz) return camera_hz;
  return info.rate_hz == wire::table::kImuHz ? imu_hz : info.rate_hz;
}

}  // namespace perdure::bus
