// Drives a lap repeatedly for an hour (or PERDURE_SOAK_SECONDS). Checks memory, lost frames,
// warnings and ids. Writes the measurements to PERDURE_SOAK_OUT.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "tests/process/soak_run.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;

double secondsAsked() {
  const char* text = std::getenv("PERDURE_SOAK_SECONDS");
  return text == nullptr ? 3600.0 : std::strtod(text, nullptr);
}

fs::path folderAsked() {
  const char* text = std::getenv("PERDURE_SOAK_OUT");
  return text == nullptr ? programs().parent_path() / "soak" : fs::path(text);
}

int sharedMemoryAsked() {
  const char* text = std::getenv("PERDURE_SOAK_SHARED_MEMORY_MB");
  return text == nullptr ? 0 : std::atoi(text);
}

TEST(Soak, NothingGrowsOrGetsLostWhileALapIsDrivenAgainAndAgain) {
  SoakRun soak(folderAsked(), sharedMemoryAsked());
  const bool ran = soak.run(secondsAsked());
  std::ofstream(folderAsked() / "soak.json") << soak.report().dump(2) << "\n";
  soak.draw(folderAsked() / "soak.png");
  std::cout << soak.report().dump(2) << std::endl;
  ASSERT_TRUE(ran);

  const SoakRun::Frames frames = soak.frames();
  EXPECT_GT(frames.given, static_cast<std::uint64_t>(19.0 * secondsAsked()));
  EXPECT_EQ(frames.without_odometry, 0u);
  EXPECT_EQ(frames.without_objects, 0u);
  // Documented behaviour: of the frames that arrive while the network is busy, inference processes
  // the newest and counts the others as dropped. Frames overwritten in its reader count as missed.
  const Health inference = soak.health().at("inference");
  const auto missed = inference.reasons.find("frames_missed");
  EXPECT_LE(frames.without_detections,
            inference.dropped + (missed == inference.reasons.end() ? 0 : missed->second));
  EXPECT_LT(static_cast<double>(frames.without_detections),
            0.01 * static_cast<double>(frames.given));

  for (const Complaint& complaint : soak.complaints()) {
    EXPECT_LE(complaint.most_in_a_minute, 1u) << complaint.service << ": " << complaint.text;
  }

  ASSERT_GE(soak.laps(), 4u) << "too short to judge what stays";
  const double end = soak.points().back().s, settled = std::max(180.0, end / 6.0);
  // An object costs the filter about half a megabyte, because each frame that waits for late
  // detections holds its belief. Freed memory stays with the process.
  constexpr double kLeast_mb = 4.0, kThing_mb = 0.8;
  const double more_things = static_cast<double>(soak.mostHeld(end) - soak.mostHeld(settled));
  for (const char* service : tools::kServices) {
    const bool holds = std::string(service) == "semantic_filter";
    EXPECT_LT(soak.growth_mb(service, settled, end),
              kLeast_mb + (holds ? kThing_mb * more_things : 0.0))
        << service << ", " << more_things << " things more";
  }
  const auto onMapAt = [&](double s) {
    const auto& points = soak.points();
    const auto at = std::find_if(points.begin(), points.end(),
                                 [&](const SoakPoint& point) { return point.s >= s; });
    return static_cast<double>(at == points.end() ? points.back().on_map : at->on_map);
  };
  EXPECT_LT(onMapAt(end), 1.25 * onMapAt(settled)) << "the street has as many things as before";
  const auto early = soak.confirmedIn(2), late = soak.confirmedIn(soak.laps() - 2);
  std::size_t kept = 0;
  for (const ObjectId id : early) kept += late.contains(id);
  std::cout << "confirmed at any time of the third lap " << early.size()
            << ", of the last whole one " << late.size() << ", of both " << kept << std::endl;
}

}  // namespace
}  // namespace perdure::test
