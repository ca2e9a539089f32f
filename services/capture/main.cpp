// perdure-capture: a drive as frames, inertial samples, speed and calibration.
#include "services/capture/playback.h"

int main(int argc, char** argv) {
  using namespace perdure;
  capture::Config config;
  return service::runService(
      argc, argv,
      {.process = "capture",
       .summary = "Publishes images, inertial samples and speed of a drive, and its calibration.",
       .describe = [&](config::Fields& fields) { capture::describe(config, fields); },
       .body =
           [&](service::Context& context) {
             capture::Playback playback(context, config);
             context.run();
           }});
}
