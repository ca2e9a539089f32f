#include "common/sim/scene.h"

#include <algorithm>

#include "common/base/errors.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

struct Entry {
  SceneName name;
  Scene (*make)(std::uint64_t seed, const SceneOptions& options);
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> list{
      {{"street",
        "Objects on both sides of a loop are found once and are the same objects on the second "
        "lap, "
        "with other streets' cars kept on the map while they are out of sight."},
       makeStreet},
      {{"room",
        "Furniture seen from all sides in a walk gets one belief each, of the right class and "
        "size, "
        "though chairs stand close together and hide each other."},
       makeRoom},
      {{"toy",
        "A toy car near by and a car far away that fill the same pixels part within a few views, "
        "while cars farther away, smaller in the image than the toy, remain cars."},
       makeToy},
      {{"occlusion",
        "A chair that goes behind a monitor and comes back is known all the while, and is the same "
        "chair when it comes back."},
       makeOcclusion},
      {{"vanish",
        "What was taken away behind one's back is given up once its place is seen to be empty; "
        "what "
        "was moved is found at its new place."},
       makeVanish},
      {{"row", "Cars parked 0.8 m apart stay ten cars: neither merged nor doubled."}, makeRow},
      {{"roll",
        "A camera that leans by up to 60 degrees leaves objects upright and where they are: the "
        "vertical comes from gravity, not from the image."},
       makeRoll},
      {{"still",
        "Without parallax the filter stays undecided between near and small and far and large: "
        "standing still is no evidence."},
       makeStill},
      {{"straight",
        "A minute of even driving, in which one camera and an IMU hardly observe their scale, "
        "drifts "
        "no more than wheels or a second camera allow."},
       makeStraight},
      {{"traffic",
        "Cars that move are kept apart from parked ones and leave nothing behind; one that drives "
        "off has moved, one that arrives becomes part of the map."},
       makeTraffic},
      {{"town",
        "The cost of a frame depends on what is in view, not on the 500 vehicles of a map of four "
        "kilometres of streets."},
       makeTown},
      {{"suburb",
        "A car that a hedge hides from one direction stays on the map while it is passed from "
        "there, and parked cars are not reported as moving, although errors of boxes last."},
       makeSuburb},
      {{"blocks",
        "In a town whose blocks are equal but for a few things, a body that comes back is known to "
        "be where it is, and never one block off."},
       makeBlocks},
      {{"kilometre",
        "After a kilometre round a block of streets every object is the same one again, though a "
        "camera and an IMU alone have drifted meanwhile."},
       makeKilometre},
      {{"random",
        "Single views for training, one a second: each looks at a thing of a class drawn evenly, "
        "from any side and as large in the image as may be; the body rests in between."},
       makeRandom},
      {{"lap",
        "A lap that ends at rest where it began, to be driven without end (capture's run.on_end: "
        "repeat): memory does not grow, no frame is lost, and objects stay the same ones."},
       makeLap},
  };
  return list;
}

std::string knownNames() {
  std::string names;
  for (const Entry& entry : entries()) names += (names.empty() ? "" : ", ") + entry.name.name;
  return names;
}

[[noreturn]] void refuse(const std::string& what) { throw StartupError(ExitCode::kUsage, what); }

void checkOptions(const SceneOptions& options) {
  if (options.seconds && !(*options.seconds > 0.0 && *options.seconds <= 3600.0)) {
    refuse("a scene lasts more than 0 and at most 3600 seconds; give other seconds");
  }
  if (!(options.rate_hz > 0.0 && options.rate_hz <= 200.0)) {
    refuse("a camera takes more than 0 and at most 200 frames a second; give another rate");
  }
  const auto fits = [](std::uint32_t side) { return side >= 16 && side <= 4096; };
  if (!fits(options.width) || !fits(options.height)) {
    refuse("an image has 16 to 4096 pixels each way; give another size");
  }
}

}  // namespace

const std::vector<SceneName>& sceneNames() {
  static const std::vector<SceneName> names = [] {
    std::vector<SceneName> list;
    for (const Entry& entry : entries()) list.push_back(entry.name);
    return list;
  }();
  return names;
}

Scene makeScene(const std::string& name, std::uint64_t seed, const SceneOptions& options) {
  const auto found = std::find_if(entries().begin(), entries().end(),
                                  [&](const Entry& entry) { return entry.name.name == name; });
  if (found == entries().end()) {
    refuse("there is no scene \"" + name + "\"; the scenes are " + knownNames());
  }
  checkOptions(options);
  Scene scene = found->make(seed, options);
  scene.proves = found->name.proves;
  return scene;
}

}  // namespace perdure::sim
