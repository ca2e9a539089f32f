#include <gtest/gtest.h>

#include "tools/demo/reporter.h"

namespace perdure::tools {
namespace {

Objects objectsOf(std::uint64_t sequence, std::int64_t captured_ns) {
  Objects objects;
  objects.stamp.sequence = sequence;
  objects.stamp.captured_ns = captured_ns;
  return objects;
}

Detections detectionsOf(std::uint64_t sequence, double forward_s) {
  Detections detections;
  detections.stamp.sequence = sequence;
  detections.forward_s = forward_s;
  return detections;
}

TEST(Latency, TakesTheNetworksTimeOutFrameByFrame) {
  LatencyMeter meter;
  meter.onDetections(detectionsOf(1, 0.030));
  meter.onObjects(objectsOf(1, 1'000'000), 36'000'000);  // 35 ms
  meter.onObjects(objectsOf(2, 2'000'000), 47'000'000);  // 45 ms; its detections arrive later
  meter.onDetections(detectionsOf(2, 0.038));
  const auto report = meter.report();
  EXPECT_DOUBLE_EQ(report["latency_ms"]["median"], 40.0);
  EXPECT_DOUBLE_EQ(report["latency_beyond_network_ms"]["median"], 6.0);
  EXPECT_NEAR(report["latency_beyond_network_ms"]["p99"], 6.98, 1e-9);
  EXPECT_DOUBLE_EQ(meter.last_ms(), 45.0);
}

TEST(Latency, CountsAFrameOnceAndLeavesOutWhatIsNotKnown) {
  LatencyMeter meter;
  meter.onDetections(detectionsOf(1, 0.010));
  meter.onObjects(objectsOf(1, 0), 12'000'000);
  meter.onObjects(objectsOf(1, 0), 99'000'000);  // repeated by a new owner
  meter.onDetections(detectionsOf(1, 0.001));    // repeated as well
  meter.onObjects(objectsOf(2, 0), 20'000'000);  // a frame without detections
  meter.onDetections(detectionsOf(3, 0.010));    // a frame without objects
  meter.onDetections(detectionsOf(4, 0.0));      // an older inference, which does not state the
                                                 // time
  meter.onObjects(objectsOf(4, 0), 16'000'000);
  const auto report = meter.report();
  EXPECT_DOUBLE_EQ(report["latency_ms"]["median"], 16.0);
  EXPECT_DOUBLE_EQ(report["latency_beyond_network_ms"]["median"], 2.0);
  EXPECT_DOUBLE_EQ(report["latency_beyond_network_ms"]["p99"], 2.0);
}

TEST(Latency, BeyondTheNetworkLeavesOutObjectsThatDidNotWaitForIt) {
  LatencyMeter meter;
  meter.onDetections(detectionsOf(1, 0.010));
  meter.onObjects(objectsOf(1, 0), 14'000'000);
  meter.onObjects(objectsOf(2, 0), 20'000'000);
  meter.onDetections(detectionsOf(2, 0.400));
  EXPECT_DOUBLE_EQ(meter.report()["latency_beyond_network_ms"]["p99"], 4.0);
}

TEST(Latency, OfNothingIsZero) {
  EXPECT_DOUBLE_EQ(LatencyMeter().report()["latency_ms"]["p99"], 0.0);
}

}  // namespace
}  // namespace perdure::tools
