// Tests whether the shapes of config/class_priors.yaml fit the simulator's objects. Compares the
// rendered outline of an object with the image of its shape, for an upright and a rolled camera.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/priors.h"
#include "tests/scenario/scenario.h"

namespace perdure::test {
namespace {

using semantic_filter::Shape, semantic_filter::State, semantic_filter::View;

semantic_filter::ClassPriors shippedPriors() {
  const char* source = std::getenv("PERDURE_SOURCE");
  return semantic_filter::loadClassPriors(std::string(source ? source : ".") +
                                          "/config/class_priors.yaml");
}

State stateOf(const sim::TruthObject& object) {
  State x = State::Zero();
  x.head<3>() = object.keys[0].centre_W;
  x[semantic_filter::kYaw] = object.keys[0].yaw;
  x.segment<3>(semantic_filter::kSize) = object.size.array().log();
  return x;
}

/// Errors of the sides, in widths and heights of the rendered outline.
struct Misfit {
  double squares = 0.0, sides = 0.0;

  void add(const Box& truth, const semantic_filter::ProjectedBox& box) {
    const double w = truth.width(), h = truth.height();
    const Eigen::Vector4d e((box.sides[0] - truth.x1) / w, (box.sides[1] - truth.y1) / h,
                            (box.sides[2] - truth.x2) / w, (box.sides[3] - truth.y2) / h);
    squares += e.squaredNorm(), sides += 4.0;
  }
  double rms() const { return std::sqrt(squares / std::max(sides, 1.0)); }
};

struct Misfits {
  Misfit of_shape, of_cuboid;
};

/// Returns the errors by class, for standing objects whose whole outline is in the image.
std::map<std::string, Misfits> misfitsIn(const Setting& setting,
                                         const semantic_filter::ClassPriors& priors) {
  const tools::SimulatedTruth truth = tools::readSimulatedTruth(sceneFolder(setting));
  const CameraModel& camera = truth.camera;
  std::map<std::uint64_t, const sim::TruthObject*> objects;
  for (const auto& o : truth.truth.objects) objects[o.id] = &o;
  std::map<std::string, Misfits> all;
  for (const auto& [frame, views] : truth.truth.views) {
    const auto pose = truth.body.at(frame, truth.frames[frame], std::chrono::milliseconds(50));
    if (!pose) continue;
    const View view{&camera, *pose, Eigen::Vector3d::UnitZ()};
    for (const auto& seen : views) {
      const sim::TruthObject& object = *objects.at(seen.object_id);
      const Box& b = seen.box;
      const bool inside = b.x1 > 2 && b.y1 > 2 && b.x2 < camera.width() - 3 &&
                          b.y2 < camera.height() - 3 && b.height() > 20;
      if (object.moves || object.keys.size() != 1 || !inside) continue;
      const Shape& shape = priors.of(object.class_name).shape;
      const auto shaped = projectCuboid(stateOf(object), view, shape, 1.0);
      const auto whole = projectCuboid(stateOf(object), view);
      if (!shaped || !whole) continue;
      all[object.class_name].of_shape.add(b, *shaped);
      all[object.class_name].of_cuboid.add(b, *whole);
    }
  }
  return all;
}

TEST(Shapes, AreThoseOfTheThingsThatTheRendererDraws) {
  const auto priors = shippedPriors();
  std::map<std::string, std::map<std::string, Misfits>> scenes;
  for (const char* scene : {"street", "room", "roll"}) {
    scenes[scene] = misfitsIn({.scene = scene, .seed = 3}, priors);
    for (const auto& [name, misfit] : scenes[scene]) {
      std::printf("%-8s %-14s cuboid %.3f  shape %.3f  (%.0f boxes)\n", scene, name.c_str(),
                  misfit.of_cuboid.rms(), misfit.of_shape.rms(), misfit.of_shape.sides / 4.0);
    }
  }
  EXPECT_LT(scenes["street"]["car"].of_shape.rms(), 0.015);
  EXPECT_LT(scenes["roll"]["car"].of_shape.rms(), 0.02);
  EXPECT_LT(scenes["street"]["van"].of_shape.rms(), 0.015);
  EXPECT_LT(scenes["roll"]["van"].of_shape.rms(), 0.03);
  EXPECT_LT(scenes["street"]["bicycle"].of_shape.rms(), 0.035);
  EXPECT_LT(scenes["street"]["person"].of_shape.rms(), 0.06);
  EXPECT_LT(scenes["room"]["monitor"].of_shape.rms(), 0.03);
  for (const auto& [scene, classes] : scenes) {
    for (const auto& [name, misfit] : classes) {
      if (priors.of(name).shape.is_cuboid || misfit.of_shape.sides < 400.0) continue;
      EXPECT_LT(misfit.of_shape.rms(), 0.75 * misfit.of_cuboid.rms()) << scene << " " << name;
    }
  }
}

}  // namespace
}  // namespace perdure::test
