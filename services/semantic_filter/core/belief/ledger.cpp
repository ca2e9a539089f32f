#include "services/semantic_filter/core/belief/ledger.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace perdure::semantic_filter {
namespace {

double sumOf(const auto& nats) { return std::accumulate(nats.begin(), nats.end(), 0.0); }

/// Returns the logarithm of a probability; it is finite for probability 0.
double logOf(double probability) { return std::log(std::max(probability, 1e-300)); }

/// Copies the entries. Leaves out kinds that this program does not have.
template <std::size_t N>
void copyKnown(const std::vector<double>& from, std::array<double, N>& to) {
  std::copy_n(from.begin(), std::min(from.size(), N), to.begin());
}

/// Adds the count of `more`. The last time never decreases, because an entry that came in a message
/// may have a later time than `more`.
void count(LedgerEntry& entry, const LedgerEntry& more) {
  if (entry.count == 0) entry.first = entry.last = more.first;
  entry.count += more.count;
  entry.last = std::max(entry.last, more.last);
}

const ClassNumber* find(const ClassNumbers& numbers, const std::string& name) {
  const auto it =
      std::find_if(numbers.begin(), numbers.end(), [&](const auto& n) { return n.name == name; });
  return it == numbers.end() ? nullptr : &*it;
}

}  // namespace

Existence::Existence(double r, const std::vector<LedgerEntry>& known, ExistenceEvidence why,
                     TimePoint at) {
  std::copy_n(known.begin(), std::min(known.size(), entries_.size()), entries_.begin());
  become(r, why, at);
}

void Existence::become(double r, ExistenceEvidence why, TimePoint at) {
  double sum = 0.0;
  for (const LedgerEntry& e : entries_) sum += e.log_odds;
  LedgerEntry& entry = entries_[static_cast<std::size_t>(why)];
  entry.log_odds += logOdds(r) - sum;
  count(entry, {0.0, 1, at, at});
  r_ = r;
}

void Existence::shift(ExistenceEvidence from, ExistenceEvidence to, double nats, TimePoint at) {
  if (nats == 0.0) return;
  entries_[static_cast<std::size_t>(from)].log_odds -= nats;
  LedgerEntry& entry = entries_[static_cast<std::size_t>(to)];
  entry.log_odds += nats;
  count(entry, {0.0, 1, at, at});
}

void Existence::note(ExistenceEvidence why, const LedgerEntry& observations) {
  if (observations.count > 0) count(entries_[static_cast<std::size_t>(why)], observations);
}

ClassAccount::ClassAccount(const std::vector<ClassLedger>& known,
                           const std::vector<OustedClass>& ousted) {
  for (const ClassLedger& c : known) copyKnown(c.log_odds, rowOf(c.name).nats);
  if (ousted.empty()) return;
  const OustedClass& o = ousted.front();
  ousted_ = {o.name, o.by, o.at, {}};
  copyKnown(o.log_odds, ousted_->nats);
}

ClassAccount::Row& ClassAccount::rowOf(const std::string& name) {
  std::vector<Row>& rows = rows_.write();
  const auto it =
      std::find_if(rows.begin(), rows.end(), [&](const Row& r) { return r.name == name; });
  if (it != rows.end()) return *it;
  rows.push_back({name, {}});
  return rows.back();
}

void ClassAccount::oust(const ClassNumbers& pmf, TimePoint at) {
  const auto best = std::max_element(
      pmf.begin(), pmf.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
  if (best == pmf.end()) return;
  const Nats winner = rowOf(best->name).nats;
  for (const Row& row : rows_.read()) {
    if (find(pmf, row.name)) continue;
    const double behind = sumOf(winner) - sumOf(row.nats);
    if (ousted_ && ousted_->by == best->name && sumOf(ousted_->nats) <= behind) continue;
    ousted_ = {row.name, best->name, at, {}};
    for (std::size_t i = 0; i < kOwnClass; ++i) ousted_->nats[i] = winner[i] - row.nats[i];
  }
  std::erase_if(rows_.write(), [&](const Row& row) { return !find(pmf, row.name); });
}

void ClassAccount::book(const ClassNumbers& pmf, ClassEvidence why, TimePoint at) {
  oust(pmf, at);
  for (const ClassNumber& c : pmf) {
    Nats& nats = rowOf(c.name).nats;
    nats[static_cast<std::size_t>(why)] += logOf(c.value) - sumOf(nats);
  }
}

void ClassAccount::shift(ClassEvidence from, ClassEvidence to, const ClassNumbers& nats) {
  for (Row& row : rows_) {
    const ClassNumber* c = find(nats, row.name);
    if (!c) continue;
    row.nats[static_cast<std::size_t>(from)] -= c->value;
    row.nats[static_cast<std::size_t>(to)] += c->value;
  }
}

void ClassAccount::publish(Ledger& to) const {
  to.classes.resize(rows_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    to.classes[i].name = rows_[i].name;
    to.classes[i].log_odds.assign(rows_[i].nats.begin(), rows_[i].nats.end());
  }
  to.ousted.resize(ousted_ ? 1 : 0);
  if (!ousted_) return;
  OustedClass& o = to.ousted.front();
  o.name = ousted_->name, o.by = ousted_->by, o.at = ousted_->at;
  o.log_odds.assign(ousted_->nats.begin(), ousted_->nats.end());
}

ClassNumbers gains(const ClassNumbers& pmf, const ClassNumbers& log_likelihood) {
  double most = -1e300, evidence = 0.0;
  for (const ClassNumber& c : log_likelihood) most = std::max(most, c.value);
  for (const ClassNumber& c : log_likelihood) {
    const ClassNumber* prior = find(pmf, c.name);
    evidence += prior ? prior->value * std::exp(c.value - most) : 0.0;
  }
  ClassNumbers result = log_likelihood;
  for (ClassNumber& c : result) c.value -= most + logOf(evidence);
  return result;
}

}  // namespace perdure::semantic_filter
