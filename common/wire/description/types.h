// Maps domain types to generated C types.
#pragma once

#include "common/types/detections.h"
#include "common/types/health.h"
#include "common/types/map.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"
#include "idl/detections.h"
#include "idl/health.h"
#include "idl/map.h"
#include "idl/objects.h"
#include "idl/odometry.h"
#include "idl/sensors.h"

namespace perdure::wire {

/// Type<T>::Wire is the generated struct; Type<T>::descriptor() is Cyclone's description of it.
template <class T>
struct Type;

template <class WireStruct, const dds_topic_descriptor_t* kDescriptor>
struct TypeOf {
  using Wire = WireStruct;
  static const dds_topic_descriptor_t& descriptor() { return *kDescriptor; }
};

template <>
struct Type<Frame> : TypeOf<perdure_msg_Frame, &perdure_msg_Frame_desc> {};
template <>
struct Type<ImuSample> : TypeOf<perdure_msg_ImuSample, &perdure_msg_ImuSample_desc> {};
template <>
struct Type<SpeedSample> : TypeOf<perdure_msg_SpeedSample, &perdure_msg_SpeedSample_desc> {};
template <>
struct Type<Calibration> : TypeOf<perdure_msg_Calibration, &perdure_msg_Calibration_desc> {};
template <>
struct Type<Odometry> : TypeOf<perdure_msg_Odometry, &perdure_msg_Odometry_desc> {};
template <>
struct Type<Landmarks> : TypeOf<perdure_msg_Landmarks, &perdure_msg_Landmarks_desc> {};
template <>
struct Type<Detections> : TypeOf<perdure_msg_Detections, &perdure_msg_Detections_desc> {};
template <>
struct Type<ModelInfo> : TypeOf<perdure_msg_ModelInfo, &perdure_msg_ModelInfo_desc> {};
template <>
struct Type<SwapNotice> : TypeOf<perdure_msg_SwapNotice, &perdure_msg_SwapNotice_desc> {};
template <>
struct Type<Objects> : TypeOf<perdure_msg_Objects, &perdure_msg_Objects_desc> {};
template <>
struct Type<ObjectState> : TypeOf<perdure_msg_ObjectState, &perdure_msg_ObjectState_desc> {};
template <>
struct Type<MapNear> : TypeOf<perdure_msg_MapNear, &perdure_msg_MapNear_desc> {};
template <>
struct Type<Event> : TypeOf<perdure_msg_Event, &perdure_msg_Event_desc> {};
template <>
struct Type<Predictions> : TypeOf<perdure_msg_Predictions, &perdure_msg_Predictions_desc> {};
template <>
struct Type<MapTile> : TypeOf<perdure_msg_MapTile, &perdure_msg_MapTile_desc> {};
template <>
struct Type<MapHeader> : TypeOf<perdure_msg_MapHeader, &perdure_msg_MapHeader_desc> {};
template <>
struct Type<MapFrame> : TypeOf<perdure_msg_MapFrame, &perdure_msg_MapFrame_desc> {};
template <>
struct Type<MapQuery> : TypeOf<perdure_msg_MapQuery, &perdure_msg_MapQuery_desc> {};
template <>
struct Type<MapReply> : TypeOf<perdure_msg_MapReply, &perdure_msg_MapReply_desc> {};
template <>
struct Type<Health> : TypeOf<perdure_msg_Health, &perdure_msg_Health_desc> {};

}  // namespace perdure::wire
