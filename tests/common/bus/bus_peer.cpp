// The other process of the bus tests. Its arguments select the messages that it publishes until it
// ends or is killed.
#include <iostream>
#include <thread>

#include "common/bus/endpoint.h"

namespace perdure::bus {
namespace {

void pause(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

/// Publishes detections at 20 Hz without end; the instance of the process is its ownership
/// strength.
void publishDetections(const Participant& participant, std::int32_t strength) {
  constexpr double kRate = 20.0;
  Writer<Detections> writer(participant, kTopic<Detections>,
                            {.strength = strength, .lease_s = leaseFor(kRate)});
  Detections message;
  message.camera = "cam0";
  message.instance = static_cast<InstanceId>(strength);
  for (;; ++message.stamp.sequence) {
    (void)writer.write(message);
    pause(1.0 / kRate);
  }
}

void publishImu(const Participant& participant, int count) {
  Writer<ImuSample> writer(participant, kTopic<ImuSample>);
  for (int i = 0; i < count; ++i) {
    ImuSample sample;
    sample.sequence = static_cast<std::uint64_t>(i);
    (void)writer.write(sample);
  }
  std::cout << "written" << std::endl;
  pause(3600);
}

/// Prints a line when it has a writer, and when it has received `count` samples.
void readImu(const Participant& participant, std::size_t count) {
  Reader<ImuSample> reader(participant, kTopic<ImuSample>);
  while (reader.matched() == 0) pause(0.01);
  std::cout << "reads" << std::endl;
  for (std::size_t got = 0; got < count; pause(0.01)) {
    reader.drain([&](const ImuSample&) { ++got; });
  }
  std::cout << "has all" << std::endl;
}

void publishTiles(const Participant& participant, int count) {
  Writer<MapTile> writer(participant, kTopic<MapTile>);
  for (int i = 0; i < count; ++i) {
    MapTile tile;
    tile.x = i;
    (void)writer.write(tile);
  }
  MapTile gone;
  gone.x = 0;
  (void)writer.dispose(gone);
  std::cout << "written" << std::endl;
  pause(3600);
}

}  // namespace
}  // namespace perdure::bus

int main(int argc, char** argv) {
  using namespace perdure::bus;
  if (argc != 3) return 64;
  const std::string what = argv[1];
  const int argument = std::atoi(argv[2]);
  const Domain domain{Options{}};
  const Participant participant(domain, "peer");
  if (what == "detections") publishDetections(participant, argument);
  if (what == "imu") publishImu(participant, argument);
  if (what == "read imu") return readImu(participant, static_cast<std::size_t>(argument)), 0;
  if (what == "tiles") publishTiles(participant, argument);
  return 64;
}
