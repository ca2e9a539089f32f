#include "common/wire/plain_twin.h"

#include <map>

#include "final/detections.h"
#include "final/health.h"
#include "final/map.h"
#include "final/objects.h"
#include "final/sensors.h"

namespace perdure::wire {
namespace {

template <class Type, class Twin>
const dds_topic_descriptor_t* checked(const dds_topic_descriptor_t& twin) {
  static_assert(sizeof(Type) == sizeof(Twin) && alignof(Type) == alignof(Twin));
  return &twin;
}

}  // namespace

const dds_topic_descriptor_t* plainTwinOf(const std::string& type_name) {
  static const std::map<std::string, const dds_topic_descriptor_t*> kTwins{
      {"perdure::msg::Calibration",
       checked<perdure_msg_Calibration, perdure_fin_Calibration>(perdure_fin_Calibration_desc)},
      {"perdure::msg::Detections",
       checked<perdure_msg_Detections, perdure_fin_Detections>(perdure_fin_Detections_desc)},
      {"perdure::msg::ModelInfo",
       checked<perdure_msg_ModelInfo, perdure_fin_ModelInfo>(perdure_fin_ModelInfo_desc)},
      {"perdure::msg::SwapNotice",
       checked<perdure_msg_SwapNotice, perdure_fin_SwapNotice>(perdure_fin_SwapNotice_desc)},
      {"perdure::msg::Objects",
       checked<perdure_msg_Objects, perdure_fin_Objects>(perdure_fin_Objects_desc)},
      {"perdure::msg::ObjectState",
       checked<perdure_msg_ObjectState, perdure_fin_ObjectState>(perdure_fin_ObjectState_desc)},
      {"perdure::msg::MapNear",
       checked<perdure_msg_MapNear, perdure_fin_MapNear>(perdure_fin_MapNear_desc)},
      {"perdure::msg::Event",
       checked<perdure_msg_Event, perdure_fin_Event>(perdure_fin_Event_desc)},
      {"perdure::msg::Predictions",
       checked<perdure_msg_Predictions, perdure_fin_Predictions>(perdure_fin_Predictions_desc)},
      {"perdure::msg::MapTile",
       checked<perdure_msg_MapTile, perdure_fin_MapTile>(perdure_fin_MapTile_desc)},
      {"perdure::msg::MapHeader",
       checked<perdure_msg_MapHeader, perdure_fin_MapHeader>(perdure_fin_MapHeader_desc)},
      {"perdure::msg::MapFrame",
       checked<perdure_msg_MapFrame, perdure_fin_MapFrame>(perdure_fin_MapFrame_desc)},
      {"perdure::msg::MapQuery",
       checked<perdure_msg_MapQuery, perdure_fin_MapQuery>(perdure_fin_MapQuery_desc)},
      {"perdure::msg::MapReply",
       checked<perdure_msg_MapReply, perdure_fin_MapReply>(perdure_fin_MapReply_desc)},
      {"perdure::msg::Health",
       checked<perdure_msg_Health, perdure_fin_Health>(perdure_fin_Health_desc)}};
  const auto twin = kTwins.find(type_name);
  return twin == kTwins.end() ? nullptr : twin->second;
}

}  // namespace perdure::wire
