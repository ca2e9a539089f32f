#include "tools/map/why.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "common/base/check.h"

namespace perdure::tools {
namespace {

constexpr double kNothing = 0.005;   // nats, displayed as 0.00
constexpr double kTolerance = 1e-6;  // largest relative error of a sum

std::string aThing(const std::string& class_name) {
  if (class_name == kOtherClass) return "something of no known class";
  const bool vowel = std::string("aeiou").find(class_name.front()) != std::string::npos;
  return (vowel ? "an " : "a ") + class_name;
}

std::string observations(std::uint32_t n) {
  return n == 1 ? "1 observation" : fmt::format("{} observations", n);
}
std::string hypotheses(std::uint32_t n) {
  return n == 1 ? "1 hypothesis" : fmt::format("{} hypotheses", n);
}
std::string times(std::uint32_t n) { return n == 1 ? "once" : fmt::format("{} times", n); }

/// Returns the text for an object that returned, with a note if it has evidence from before this
/// ledger.
std::string backFrom(const char* where, const LedgerEntry& entry) {
  return fmt::format(
      "back from {} {}{}", where, times(entry.count),
      std::abs(entry.log_odds) < kNothing ? "" : ": evidence from before this ledger");
}

std::string sentence(ExistenceEvidence kind, const LedgerEntry& entry) {
  constexpr std::array kSentences{
      "before its first box: few boxes are new objects",
      "detected in {observations}",
      "detected in {observations} more from the same place: little weight",
      "not detected in {observations} of its place",
      "of these excused: an object that is not on the map may have occluded it",
      "{observations} not used: it was occluded",
      "{observations} not used: it was out of view",
      "time passed: objects leave",
      "{hypotheses} removed: no longer of the size of their class",
      "{hypotheses} removed: that it drove off unseen",
      "its first box may have been another object's",
      "merged {times} with an object that was the same",
      "",
      "",
      "stated by people {times}"};
  if (kind == ExistenceEvidence::kRestore) return backFrom("a restart", entry);
  if (kind == ExistenceEvidence::kRecall) return backFrom("the map", entry);
  const std::uint32_t n = entry.count;
  return fmt::format(fmt::runtime(nameAt(kSentences, kind)),
                     fmt::arg("observations", observations(n)),
                     fmt::arg("hypotheses", hypotheses(n)), fmt::arg("times", times(n)));
}

const char* sentence(ClassEvidence kind) {
  constexpr std::array kSentences{"how frequent the two are",
                                  "activations of the network in its boxes",
                                  "how well size and place explain the boxes",
                                  "observations without a detection",
                                  "whether it moves",
                                  "hypotheses that were removed",
                                  "merged objects",
                                  "evidence from before this ledger",
                                  "objects near it",
                                  "stated by people"};
  return nameAt(kSentences, kind);
}

std::string line(double nats, const std::string& what) {
  return fmt::format("  {:>+8.2f}  {}\n", std::abs(nats) < kNothing ? 0.0 : nats, what);
}

/// Returns the time span of the evidence; empty for evidence that is not an observation.
std::string span(ExistenceEvidence kind, const LedgerEntry& entry) {
  switch (kind) {
    case ExistenceEvidence::kHit:
    case ExistenceEvidence::kRepeated:
    case ExistenceEvidence::kMiss:
    case ExistenceEvidence::kHidden:
    case ExistenceEvidence::kAway:
      break;
    default:
      return {};
  }
  if (entry.count == 1) return fmt::format(" (at {:.3f} s)", toSeconds(entry.first));
  return fmt::format(" ({:.3f} s to {:.3f} s)", toSeconds(entry.first), toSeconds(entry.last));
}

std::string existenceLines(const ObjectBelief& o) {
  std::string text;
  for (std::size_t i = 0; i < o.why.existence.size(); ++i) {
    const LedgerEntry& entry = o.why.existence[i];
    const auto kind = static_cast<ExistenceEvidence>(i);
    if (entry.count == 0 && std::abs(entry.log_odds) < kNothing) continue;
    const std::string what = i < kExistenceEvidences
                                 ? sentence(kind, entry) + span(kind, entry)
                                 : "evidence of a kind that this program does not know";
    text += line(entry.log_odds, what);
  }
  const double published = logOdds(o.existence);
  text += line(o.why.logOdds(), "together");
  if (std::abs(o.why.logOdds() - published) > kTolerance) {
    text +=
        fmt::format("  That is not what is believed ({:+.2f}): the ledger is faulty.\n", published);
  }
  return text;
}

std::string odds(double nats) {
  const double ratio = std::exp(nats);
  return ratio < 1e4 ? fmt::format("{:.1f} to 1", ratio) : fmt::format("{:.0e} to 1", ratio);
}

std::string natsLines(const std::vector<double>& nats) {
  std::string text;
  double sum = 0.0;
  for (std::size_t i = 0; i < nats.size(); ++i) {
    sum += nats[i];
    if (std::abs(nats[i]) < kNothing) continue;
    text +=
        line(nats[i], i < kClassEvidences ? sentence(static_cast<ClassEvidence>(i))
                                          : "evidence of a kind that this program does not know");
  }
  return text + line(sum, "together");
}

const ClassLedger* ledgerOf(const Ledger& ledger, const std::string& class_name) {
  for (const ClassLedger& each : ledger.classes) {
    if (each.name == class_name) return &each;
  }
  return nullptr;
}

std::string rivalLines(const ObjectBelief& o) {
  const ClassBelief &best = o.best(), &next = o.classes[1];
  const ClassLedger *a = ledgerOf(o.why, best.name), *b = ledgerOf(o.why, next.name);
  if (!a || !b) return "The ledger does not say why.\n";
  std::vector<double> nats(std::max(a->log_odds.size(), b->log_odds.size()), 0.0);
  for (std::size_t i = 0; i < a->log_odds.size(); ++i) nats[i] += a->log_odds[i];
  for (std::size_t i = 0; i < b->log_odds.size(); ++i) nats[i] -= b->log_odds[i];
  return fmt::format("It is {} rather than {} ({:.3f}), {}:\n", aThing(best.name),
                     aThing(next.name), next.probability,
                     odds(std::log(best.probability / next.probability))) +
         natsLines(nats);
}

std::string oustedLines(const OustedClass& ousted) {
  double sum = 0.0;
  for (const double each : ousted.log_odds) sum += each;
  return fmt::format("That it is {} was given up at {:.3f} s; {} was the better one, {}:\n",
                     aThing(ousted.name), toSeconds(ousted.at), aThing(ousted.by), odds(sum)) +
         natsLines(ousted.log_odds);
}

}  // namespace

std::string toWhy(const ObjectBelief& o) {
  std::string text = fmt::format(
      "Object {} exists with probability {:.3f}; if it does, it is {} with probability {:.3f}.\n"
      "It was first seen at {:.3f} s, and last {:.3f} s later.\n",
      o.id, o.existence, aThing(o.best().name), o.best().probability, toSeconds(o.first_seen),
      toSeconds(o.last_seen - o.first_seen));
  if (o.why.empty()) {
    return text + "Its ledger is empty: the filter that believed in it is an older one.\n";
  }
  text += "\nThat it exists, in log-odds (+0.69 doubles the odds, +2.30 makes them tenfold):\n" +
          existenceLines(o);
  if (o.classes.size() > 1) text += "\n" + rivalLines(o);
  for (const OustedClass& each : o.why.ousted) text += "\n" + oustedLines(each);
  return text;
}

}  // namespace perdure::tools
