// Configuration of the gateway.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/config/fields.h"
#include "services/gateway/web/guard.h"

namespace perdure::gateway {

struct Config {
  web::Options web;
  std::string page_folder, page_truth;
  std::vector<std::string> cameras = {"cam0"};
  double image_rate_hz = 10.0;
  std::int64_t image_quality = 70;
  double scene_rate_hz = 20.0;
};

void describe(Config& config, config::Fields& fields);
/// Checks conditions between fields. Throws StartupError (78) if one is violated.
void verify(const Config& config);

}  // namespace perdure::gateway
