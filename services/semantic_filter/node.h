// The filter as a node: checks messages, waits for detections, publishes. Single-threaded.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "common/base/result.h"
#include "common/base/sink.h"
#include "common/types/map.h"
#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/history.h"
#include "services/semantic_filter/core/memory/archive.h"
#include "services/semantic_filter/corrections.h"
#include "services/semantic_filter/events.h"
#include "services/semantic_filter/model_book.h"
#include "services/semantic_filter/return_events.h"

namespace perdure::semantic_filter {

struct Outputs {
  Sink<Objects> objects;  ///< one for each odometry frame, in order
  Sink<Event> events;
  Sink<Predictions> predictions;
};

class Node {
 public:
  Node(const Config& config, const ClassPriors& priors, InstanceId instance, Outputs outputs);

  void onCalibration(const Calibration& calibration);
  void onModel(const ModelInfo& model);
  void onSwap(const SwapNotice& notice);
  void onOdometry(const Odometry& odometry);
  void onLandmarks(const Landmarks& landmarks);
  void onDetections(const Detections& detections);
  void onNear(const MapNear& near);
  /// Steps and publishes the newest frame, with or without its detections, if that is still to do.
  /// Must be called at the end of the data, or if detections stop.
  void flush();

  const ReasonCounts& reasons() const { return reasons_; }
  InstanceId instance() const { return instance_; }
  const Belief& belief() const { return history_.belief(); }
  std::string note() const;

 private:
  using Frame = HistoryFrame;

  void beginWorld(const WorldId& world);
  const char* refusalOf(const Detections& detections) const;
  std::optional<Eigen::Vector2d> pixelOf(const Landmark& landmark, const std::string& camera,
                                         const View& view) const;
  bool attach(Frame& frame, const Detections& detections);
  bool use(Frame& frame, const Detections& detections);
  void keepEarly(const Detections& detections);
  void forgetEarlyBefore(TimePoint time);
  void publish(const Frame& frame);
  void publishPredictions(const Frame& frame, const std::optional<ComingFrame>& coming);
  // These are in node_swap.cpp.
  void reportModelChange(const FrameStamp& stamp, const std::string& detail);
  bool isInDoubt(const Frame& frame, const Detections& detections);
  void settleProbation(bool believed);
  // These are in node_memory.cpp.
  void letGo(const Frame& frame);
  void take(const MapNear& near, ExistenceEvidence evidence);
  Arrivals arrivalsOf(const MapNear& near, ExistenceEvidence evidence);
  void noteMerge(TrackId survivor, TrackId absorbed);
  void nameObjects();
  ObjectId objectOf(TrackId track) const;
  TrackId trackOf(ObjectId object) const;
  void keepEnded(const std::vector<EndedTrack>& ended);
  void dropOldestEnded();

  Config config_;
  InstanceId instance_;
  Outputs outputs_;
  ReasonCounts reasons_;
  History history_;
  std::shared_ptr<const CameraModel> camera_;  // shared with the frames that use it
  std::string camera_name_;
  ModelBook models_;
  Probation probation_;
  std::optional<WorldId> world_;
  std::deque<Detections> early_;
  std::optional<MapNear> waiting_near_;  ///< arrived before the first odometry
  InstanceId near_source_ = 0;           ///< writer of the newest `map/near` in use
  std::uint64_t near_revision_ = 0;
  std::map<TrackId, ObjectId> members_;    ///< as reported by the map
  Corrections corrections_;                ///< as reported by the map
  std::map<TrackId, ObjectId> object_of_;  ///< as published; tracks with their own id are left out
  std::map<ObjectId, TrackId> track_of_;
  std::deque<EndedTrack> ended_;
  std::set<TrackId> ended_confirmed_;  ///< merged tracks of `ended_` that had been confirmed
  Objects published_;                  ///< the newest message; the next one reuses its memory
  EventTracker events_;
  ReappearanceMonitor returns_;
  Archive archive_;
};

}  // namespace perdure::semantic_filter
