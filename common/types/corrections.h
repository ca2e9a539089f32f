// Corrections: what people state about objects of the map. The map stores them beside the beliefs,
// which they never change: a published belief is the stored one plus the standing corrections.
// Withdrawing a correction therefore restores the belief bit for bit.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/types/description.h"
#include "common/types/objects.h"

namespace perdure {

enum class CorrectionKind : std::uint8_t {
  kNotThere = 0,  ///< `object` does not exist
  kClass,         ///< `object` is of class `class_name`
  kSame,          ///< `object` and `other` are one object
  kDifferent,     ///< `object` and `other` are two objects
};
const char* nameOf(CorrectionKind kind);  ///< "not_there", "class", "same", "different"

struct Correction {
  std::uint64_t id = 0;  ///< assigned by the map; 0 in requests for a new one
  CorrectionKind kind = CorrectionKind::kNotThere;
  ObjectId object = 0;
  ObjectId other = 0;      ///< for kSame and kDifferent
  std::string class_name;  ///< for kClass
  double nats = 0.0;       ///< log-likelihood ratio of the statement; 0 in requests: the default
  std::string author;
  TimePoint time;  ///< the newest frame of the map at that time
  bool withdrawn = false;

  bool aboutTwo() const {
    return kind == CorrectionKind::kSame || kind == CorrectionKind::kDifferent;
  }
  bool operator==(const Correction&) const = default;
};
inline constexpr std::size_t kMostCorrections = 4096;
inline constexpr double kMostCorrectionNats = 50.0;  ///< of one correction

/// A request to the map: adds the correction, or withdraws the one with this id if
/// correction.withdrawn is set. The answer is a MapReply.
struct MapCorrection {
  InstanceId client = 0;
  std::uint64_t request = 0;  ///< client and request form the correlation id
  Correction correction;
};

/// The standing corrections of each object.
using CorrectionsOf = std::map<ObjectId, std::vector<Correction>>;
/// `object_of` returns the present object of an id that a correction has.
CorrectionsOf standingByObject(const std::vector<Correction>& corrections,
                               const std::function<ObjectId(ObjectId)>& object_of);

/// Adds the corrections of the object `belief.id` to its existence and class probabilities, with
/// entries kPerson in its ledger. A class that the belief lacks gets the geometry of the best one.
/// An object with an existence below 1/2 is not confirmed any more.
void correct(const CorrectionsOf& corrections, ObjectBelief& belief);

}  // namespace perdure

namespace perdure::wire {

void describe(auto& a, Is<Correction> auto& d, auto& w) {
  a.value("id", d.id, w.correction_id);
  a.choice("kind", d.kind, w.kind, CorrectionKind::kDifferent);
  a.value("object", d.object, w.object_id);
  a.value("other", d.other, w.other_id);
  a.text("class_name", d.class_name, w.class_name, kNameLength);
  a.number("nats", d.nats, w.nats, Limits{0.0, kMostCorrectionNats});
  a.text("author", d.author, w.author, kNameLength);
  a.time("time_ns", d.time, w.time_ns);
  a.value("withdrawn", d.withdrawn, w.withdrawn);
}

void describe(auto& a, Is<MapCorrection> auto& d, auto& w) {
  a.value("client", d.client, w.client);
  a.value("request", d.request, w.request);
  a.object("correction", d.correction, w.correction);
}

}  // namespace perdure::wire
