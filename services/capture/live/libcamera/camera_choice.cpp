#include "services/capture/live/libcamera/camera_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace perdure::capture {

Result<std::size_t> chooseCamera(const std::vector<std::string>& ids, const std::string& wanted,
                                 bool alone) {
  const auto place = [&](auto found) { return static_cast<std::size_t>(found - ids.begin()); };
  const auto exact = std::ranges::find(ids, wanted);
  if (exact != ids.end()) return place(exact);
  const auto has = [&](const std::string& id) { return id.find(wanted) != std::string::npos; };
  const auto first = std::ranges::find_if(ids, has);
  const auto n = std::ranges::count_if(ids, has);
  if (n == 0) {
    return fail("camera_absent",
                fmt::format("libcamera sees no camera{} (there are: {}); is it plugged in, and may "
                            "this user read /dev/video* and /dev/media*?",
                            wanted.empty() ? "" : " with " + wanted + " in its id",
                            ids.empty() ? "none" : fmt::format("{}", fmt::join(ids, ", "))));
  }
  if (alone && n > 1) {
    return fail("camera_absent",
                fmt::format("{} cameras have {} in their ids ({}), and which of them is left may "
                            "not change; set camera.id and camera.second to whole ids.",
                            n, wanted, fmt::join(ids, ", ")));
  }
  return place(first);
}

}  // namespace perdure::capture
