// perdure-capture: publishes a drive or live sensors.
#include <string_view>

#include "services/capture/list.h"
#include "services/capture/live.h"
#include "services/capture/live/libcamera/session.h"
#include "services/capture/playback.h"

int main(int argc, char** argv) {
  using namespace perdure;
  if (argc > 1 && std::string_view(argv[1]) == "--list") {
    return capture::listSensors({argv + 2, argv + argc});
  }
  capture::Config config;
  return service::runService(
      argc, argv,
      {.process = "capture",
       .summary = "Publishes images, inertial samples and speed, and their calibration. "
                  "perdure-capture --list [ip:HOST] names the cameras and IMUs that are here.",
       .describe = [&](config::Fields& fields) { capture::describe(config, fields); },
       .body =
           [&](service::Context& context) {
             if (config.source == "libcamera") {
               capture::Live live(context, config, capture::libcameraOpeners);
               return context.run();
             }
             capture::Playback playback(context, config);
             context.run();
           },
       .verify =
           [&] {
             if (config.source != "libcamera") return;
             capture::requireSource(config);
             capture::checkVehicle(config.speed, config.gnss);
           }});
}
