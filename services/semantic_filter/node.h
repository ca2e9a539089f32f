// The semantic filter as a node: odometry, landmarks, detections and recalled objects in; objects,
// events and predictions out. Single-threaded; time enters by messages only.
//
// What is estimated is core/history's. The node checks messages, waits for detections, and
// publishes.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>

#include "common/base/result.h"
#include "common/base/sink.h"
#include "common/types/map.h"
#include "services/semantic_filter/config.h"
#include "services/semantic_filter/core/history.h"
#include "services/semantic_filter/core/memory/archive.h"
#include "services/semantic_filter/events.h"
#include "services/semantic_filter/model_book.h"
#include "services/semantic_filter/probation.h"
#include "services/semantic_filter/return_events.h"

namespace perdure::semantic_filter {

struct Outputs {
  Sink<Objects> objects;  ///< one for each odometry frame, in order
  Sink<Event> events;
  Sink<Predictions> predictions;
  Sink<MapQuery> queries = {};  ///< to the map, for what comes near
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
  void onRecalled(const Recalled& recalled);
  /// Publishes the newest frame even though its detections have not come: the end of the data, or
  /// a tick of a service whose detections have stopped.
  void flush();

  const ReasonCounts& reasons() const { return reasons_; }
  InstanceId instance() const { return instance_; }
  const Belief& belief() const { return history_.belief(); }
  /// For people: how far the network's boxes err.
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
  // In node_swap.cpp.
  void reportModelChange(const FrameStamp& stamp, const std::string& detail);
  bool isInDoubt(const Frame& frame, const Detections& detections);
  void settleProbation(bool believed);
  // In node_memory.cpp.
  std::vector<ObjectBelief> soundOf(std::vector<ObjectBelief> beliefs);
  void insertRecalled(const Recalled& recalled);
  void restore(const ObjectBelief& belief);
  void recall(const ObjectBelief& belief);
  void insertLaid(const Recalled& recalled);
  bool isNear(const ObjectBelief& belief) const;
  void letGo(const Frame& frame);
  void askTheMap(const Frame& frame);
  void ask(const Archive::Question& question, const WorldId& world);

  Config config_;
  InstanceId instance_;
  Outputs outputs_;
  ReasonCounts reasons_;
  History history_;
  std::shared_ptr<const CameraModel> camera_;  // shared with the frames that were made with it
  std::string camera_name_;
  ModelBook models_;
  Probation probation_;
  std::optional<WorldId> world_;
  std::deque<Detections> early_;
  std::optional<Recalled> waiting_recalled_;
  Objects published_;  ///< the newest message, whose memory the next one takes
  EventTracker events_;
  ReappearanceMonitor returns_;
  Archive archive_;
};

}  // namespace perdure::semantic_filter
