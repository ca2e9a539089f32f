// Corrections of each kind, for tests.
#pragma once

#include <string>

#include "common/types/corrections.h"

namespace perdure::test {

inline Correction notThere(ObjectId object, double nats = 0.0, const std::string& author = "") {
  Correction correction;
  correction.object = object;
  correction.nats = nats;
  correction.author = author;
  return correction;
}

inline Correction rightClass(ObjectId object, const std::string& name, double nats = 0.0) {
  Correction correction = notThere(object, nats);
  correction.kind = CorrectionKind::kClass;
  correction.class_name = name;
  return correction;
}

/// kSame or kDifferent.
inline Correction ofTwo(CorrectionKind kind, ObjectId object, ObjectId other, double nats = 0.0,
                        std::uint64_t id = 0) {
  Correction correction = notThere(object, nats);
  correction.kind = kind;
  correction.other = other;
  correction.id = id;
  return correction;
}

inline Correction withdrawal(std::uint64_t id) {
  Correction correction;
  correction.id = id;
  correction.withdrawn = true;
  return correction;
}

}  // namespace perdure::test
