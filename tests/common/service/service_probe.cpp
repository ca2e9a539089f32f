// A small service for the tests of runService. It turns each IMU sample into a speed sample.
// Sequence number 1001 makes its handler hang; 1002 marks its worker thread as hung.
#include <chrono>
#include <thread>

#include "common/service/service.h"

using namespace perdure;

int main(int argc, char** argv) {
  double gain = 1.0;
  std::int64_t points = 100;
  bool verbose = false;
  const auto describe = [&](config::Fields& fields) {
    fields.number("gain", gain, config::positive(), {"factor", "m/s", "use 1"});
    fields.integer("points", points, config::between(1, 200), {"how many"});
    fields.boolean("verbose", verbose, {"says more"});
  };
  const auto body = [&](service::Context& context) {
    ReasonCounts reasons;
    bool worker_goes_on = true;
    context.watch([&] { return worker_goes_on; });
    const Sink<SpeedSample> speed = context.sink(bus::kTopic<SpeedSample>);
    context.countReasons([&]() -> const ReasonCounts& { return reasons; });
    service::Input& input = context.needs("samples", "send some");
    context.on(bus::kTopic<ImuSample>, [&](const ImuSample& m) {
      if (m.sequence > 0) input.heard();
      context.health().frameIn();
      reasons.add("seen");
      if (m.sequence == 1001) std::this_thread::sleep_for(std::chrono::seconds(60));
      if (m.sequence == 1002) worker_goes_on = false;
      SpeedSample sample;
      sample.sequence = m.sequence;
      sample.speed = gain * m.accel.x();
      speed(sample);
      context.health().frameOut();
    });
    context.run();
  };
  return service::runService(argc, argv, {"probe", "A service for tests.", describe, body});
}
