// Corrections as JSON, as clients of the gateway and of the MCP server send and receive them.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "common/types/corrections.h"

namespace perdure {

inline constexpr char kCorrectionForms[] =
    "{\"object\": 12, \"kind\": \"not_there\"}, {\"object\": 12, \"kind\": \"class\", \"class\": "
    "\"car\"}, {\"object\": 12, \"kind\": \"same\" or \"different\", \"other\": 15}, or "
    "{\"withdraw\": 3}";

/// Returns the correction of a request in one of the forms, with "nats" and "author" if given. A
/// field that is null counts as absent. Returns nothing if the request has another form.
std::optional<Correction> correctionOf(const nlohmann::ordered_json& request);

nlohmann::ordered_json toJson(const Correction& correction);

}  // namespace perdure
