// `scenes`: prints the table of each scene's bars with measured values, and the history of one true
// object.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "common/base/errors.h"
#include "tests/scenario/bars.h"

namespace {

using namespace perdure;  // NOLINT

/// Prints the published objects near a true object, frame by frame.
void trace(const test::Outcome& run, std::uint64_t truth_id, double within) {
  for (const auto& object : run.truth.truth.objects) {
    if (object.id != truth_id) continue;
    for (const auto& f : run.journal.frames) {
      const auto truth = object.at(f.time);
      const auto* view = run.viewOf(object, f.frame);
      for (const auto& g : f.objects) {
        const double apart = (g.centre - truth.centre_W).norm();
        if (apart > within) continue;
        fmt::print(
            "{:4} id {:4} {:12} pi {:.3f} r {:.3f} {} {} moving {:.2f} apart {:.2f} at {:.1f} "
            "{:.1f} "
            "{:.1f} hits {} misses {} seen {:.2f}\n",
            f.frame, g.id, g.className(), g.pmf.front().second, g.existence,
            g.confirmed ? "confirmed" : "-", nameOf(g.visibility), g.moving, apart, g.centre.x(),
            g.centre.y(), g.centre.z(), g.hits, g.visible_misses,
            view != nullptr ? view->visible_fraction : 0.0);
      }
    }
  }
}

/// Prints when an object was first and last published, and the changes of its state.
void tell(const test::Outcome& run, ObjectId id, const Eigen::Vector3d& place) {
  const auto seen = run.journal.of(id);
  const auto line = [&](std::size_t i, const char* what) {
    const auto& [frame, g] = seen[i];
    fmt::print(
        "  {:4} {:11} id {:4} {} {:.2f} r {:.3f} {} {} moving {:.2f} apart {:.2f} hits {} misses "
        "{}\n",
        frame->frame, what, id, g->className(), g->pmf.front().second, g->existence,
        g->confirmed ? "confirmed" : "-", nameOf(g->visibility), g->moving,
        (g->centre - place).norm(), g->hits, g->visible_misses);
  };
  if (seen.empty()) return;
  line(0, "first");
  for (std::size_t i = 1; i < seen.size(); ++i) {
    const test::Glance &a = *seen[i - 1].second, &b = *seen[i].second;
    if (seen[i].first->frame > seen[i - 1].first->frame + 1) {
      line(i, "again");
    } else if (a.confirmed != b.confirmed) {
      line(i, b.confirmed ? "confirmed" : "unconfirmed");
    } else if (a.className() != b.className()) {
      line(i, "class");
    } else if ((a.moving > 0.5) != (b.moving > 0.5)) {
      line(i, "motion");
    }
  }
  line(seen.size() - 1, "last");
  const auto is = [id](const nlohmann::json& e, const char* key) {
    return e.contains(key) && e[key].get<std::uint64_t>() == id;
  };
  for (const auto& e : run.events) {
    const std::string kind = e["event"];
    const bool ends = (is(e, "object_id") && (kind == "gone" || kind == "moved")) ||
                      (kind == "merged" && (is(e, "object_id") || is(e, "other_id")));
    if (ends) fmt::print("    {}\n", e.dump());
  }
}

/// Prints the histories of both ids for each true object whose id changed between the halves.
void changedIds(const test::Outcome& run) {
  for (const auto& [object, first, second] : test::idsByHalf(run)) {
    if (first == second) continue;
    fmt::print("seed {} truth {} {}: id {} then {}\n", run.setting.seed, object->id,
               object->class_name, first, second);
    tell(run, first, object->keys[0].centre_W);
    tell(run, second, object->keys[0].centre_W);
  }
}

/// Prints the history of each ghost on the map, and the true objects that were nearest when it was
/// detected.
void tellOfGhosts(const test::Outcome& run) {
  for (const auto& ghost : test::ghosts(run)) {
    const auto nearest = test::foundNearest(run, ghost.id);
    fmt::print("seed {} ghost at {:.1f} {:.1f} {:.1f}, found nearest to", run.setting.seed,
               ghost.centre.x(), ghost.centre.y(), ghost.centre.z());
    for (const auto& [object, times] : nearest) {
      fmt::print(" {} {}{} ({} times)", object->class_name, object->id,
                 object->moves ? " which moves" : "", times);
    }
    fmt::print("\n");
    tell(run, ghost.id, ghost.centre);
  }
}

/// Sets the environment that ctest gives to the tests.
void findSources() {
  namespace fs = std::filesystem;
  const fs::path source = fs::current_path();
  if (!fs::exists(source / "config" / "semantic_filter.yaml")) {
    throw StartupError(ExitCode::kUsage, "scenes: run it from the root of the sources");
  }
  const fs::path build = fs::read_symlink("/proc/self/exe").parent_path().parent_path();
  setenv("PERDURE_SOURCE", source.c_str(), 0);
  setenv("PERDURE_BIN", (build / "bin").c_str(), 0);
}

int run(int argc, char** argv) {
  test::Setting setting;
  std::size_t seeds = 3;
  std::uint64_t first = 1, truth = 0;
  bool changed = false, of_ghosts = false;
  double within = 3.0;
  std::vector<std::string> scenes = test::scenesWithBars();
  CLI::App app("What each scene must show, and what the filter makes of it");
  app.add_option("--scene", scenes, "One or more; all without it");
  app.add_option("--seeds", seeds, "Of each scene")->capture_default_str();
  app.add_option("--seed", first, "The first")->capture_default_str();
  app.add_flag("--vio", setting.images, "Rendered, with vio in place of true poses");
  app.add_option("--seconds", setting.seconds, "Of the scene; its own length without it");
  app.add_option("--rate", setting.rate_hz, "Frames a second")->capture_default_str();
  app.add_option("--set", setting.assignments, "semantic_filter.KEY=VALUE or detector.KEY=VALUE");
  app.add_option("--truth", truth, "Print what is believed near this true object, by frame");
  app.add_flag("--changed-ids", changed, "Print what became of ids that the second half has not");
  app.add_flag("--ghosts", of_ghosts, "Print what is on the map in the end where nothing stands");
  app.add_option("--within", within, "Metres from it")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  findSources();
  std::vector<std::uint64_t> numbers;
  for (std::size_t i = 0; i < seeds; ++i) numbers.push_back(first + i);
  for (const auto& scene : scenes) {
    if (changed || of_ghosts) {
      for (const auto seed : numbers) {
        setting.scene = scene;
        setting.seed = seed;
        const auto outcome = test::runScene(setting);
        if (changed) changedIds(outcome);
        if (of_ghosts) tellOfGhosts(outcome);
      }
      continue;
    }
    if (truth != 0) {
      setting.scene = scene;
      setting.seed = first;
      trace(test::runScene(setting), truth, within);
      continue;
    }
    fmt::print("{}\n", scene);
    print(test::judge(test::barsOf(scene, numbers, setting)));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const perdure::StartupError& error) {
    std::cerr << error.what() << std::endl;
    return static_cast<int>(error.code());
  } catch (const std::exception& error) {
    std::cerr << "scenes: " << error.what() << std::endl;
    return 1;
  }
}
