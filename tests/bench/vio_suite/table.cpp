#include "tests/bench/vio_suite/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace perdure::bench {
namespace {

const char* nameOf(Half half) { return half == Half::kTuned ? "tuned" : "judged"; }

std::string percent(const std::optional<double>& share) {
  return share ? fmt::format("{:.2f}", 100.0 * *share) : "";
}

NeesAt meanOf(const std::vector<NeesAt>& all) {
  NeesAt mean;
  for (const NeesAt& n : all) {
    const auto count = static_cast<double>(all.size());
    mean.position += n.position / count;
    mean.yaw += n.yaw / count;
    mean.velocity += n.velocity / count;
  }
  return mean;
}

double ratio(double a, double b) { return b > 0.0 ? a / b : 0.0; }

}  // namespace

void Table::add(const Clip& clip, const std::string& variant, const Outcome& outcome) {
  rows_.push_back({clip.name, variant, clip.half, outcome});
}

void Table::add(const std::vector<StartRow>& starts) {
  starts_.insert(starts_.end(), starts.begin(), starts.end());
}

void Table::sort() {
  std::stable_sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) {
    return std::tie(a.half, a.clip) < std::tie(b.half, b.clip);
  });
  std::stable_sort(starts_.begin(), starts_.end(), [](const StartRow& a, const StartRow& b) {
    return std::tie(a.variant, a.clip, a.cut_s) < std::tie(b.variant, b.clip, b.cut_s);
  });
}

void Table::print(std::ostream& out) {
  sort();
  if (!starts_.empty()) return printStarts(out);
  out << fmt::format(
      "{:<15}{:<7}{:<12}{:>7}{:>7}{:>7}{:>7}{:>7}{:>7}{:>8}{:>7}{:>7}{:>7}{:>7}{:>6}{:>6}{:>6}{:>7}"
      "{:>7}{:>6}{:>6}{:>7}{:>6}\n",
      "clip", "half", "variant", "way m", "ATE m", "scale", "2m %", "5m %", "10m %", "50m %",
      "NEES p", "yaw", "v", "in", "start", "ms", "p99", "x KLT", "p99 x", "NIS", "white", "used",
      "reset");
  for (const Row& r : rows_) {
    const Outcome& o = r.outcome;
    const NeesAt nees = meanOf(o.accuracy.nees);
    out << fmt::format(
        "{:<15}{:<7}{:<12}{:>7.1f}{:>7.3f}{:>7.3f}{:>7}{:>7}{:>7}{:>8}{:>7.2f}{:>7.2f}{:>7.2f}{:>7}"
        "{:>6.2f}{:>6.2f}{:>6.2f}{:>7.2f}{:>7.2f}{:>6.2f}{:>6.2f}{:>7.3f}{:>6}\n",
        r.clip, nameOf(r.half), r.variant, o.accuracy.length_m, o.accuracy.ate_m, o.accuracy.scale,
        percent(o.accuracy.relative[0]), percent(o.accuracy.relative[1]),
        percent(o.accuracy.relative[2]), percent(o.accuracy.relative[3]), nees.position, nees.yaw,
        nees.velocity, fmt::format("{}/{}", o.accuracy.in_band, o.accuracy.asked), o.first_s, o.ms,
        o.ms_p99, ratio(o.ms, o.klt_ms), ratio(o.ms_p99, o.klt_ms), o.innovations.size(),
        o.innovations.whiteness(), o.innovations.used(), o.resets);
  }
  printMeans(out);
}

void Table::printMeans(std::ostream& out) const {
  struct Sum {
    double ate = 0, log_ate = 0, ratio = 0, n = 0;
    int in = 0, asked = 0;
  };
  std::map<std::pair<std::string, Half>, Sum> sums;
  for (const Row& r : rows_) {
    Sum& s = sums[{r.variant, r.half}];
    s.ate += r.outcome.accuracy.ate_m;
    s.log_ate += std::log(std::max(r.outcome.accuracy.ate_m, 1e-6));
    s.ratio += ratio(r.outcome.ms, r.outcome.klt_ms);
    s.in += r.outcome.accuracy.in_band;
    s.asked += r.outcome.accuracy.asked;
    ++s.n;
  }
  for (const auto& [key, s] : sums) {
    out << fmt::format(
        "{:<12} {:<7} {:>2} clips: ATE mean {:.4f} m, geometric {:.4f} m; NEES in band {}/{}; "
        "{:.2f} x KLT\n",
        key.first, nameOf(key.second), static_cast<int>(s.n), s.ate / s.n,
        std::exp(s.log_ate / s.n), s.in, s.asked, s.ratio / s.n);
  }
}

void Table::printStarts(std::ostream& out) const {
  out << fmt::format("{:<12}{:<15}{:>7}{:>7}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8} {}\n", "variant",
                     "clip", "cut s", "after", "scale", "err m", "v err", "v sigma", "NEES p",
                     "yaw", "v", "");
  struct Sum {
    int n = 0, started = 0, soon = 0, wrong = 0, reset = 0;
    double after = 0, p = 0, yaw = 0, v = 0;
  };
  std::map<std::string, Sum> sums;
  for (const StartRow& r : starts_) {
    out << fmt::format(
        "{:<12}{:<15}{:>7.2f}{:>7.2f}{:>8.3f}{:>8.3f}{:>8.3f}{:>8.3f}{:>8.2f}{:>8.2f}{:>8.2f} "
        "{}{}\n",
        r.variant, r.clip, r.cut_s, r.moving_s, r.scale, r.error_m, r.velocity_error,
        r.velocity_sigma, r.nees.position, r.nees.yaw, r.nees.velocity, r.wrong ? "wrong " : "",
        r.reset ? "reset" : "");
    Sum& s = sums[r.variant];
    ++s.n;
    s.soon += r.moving_s >= 0.0 && r.moving_s <= 0.5;
    s.wrong += r.wrong;
    s.reset += r.reset;
    if (r.moving_s < 0.0) continue;
    ++s.started;
    s.after += r.moving_s;
    s.p += r.nees.position;
    s.yaw += r.nees.yaw;
    s.v += r.nees.velocity;
  }
  for (const auto& [variant, s] : sums) {
    const double n = std::max(1, s.started);
    out << fmt::format(
        "{}: {} cuts, {} started, {} within .5 s, mean {:.2f} s; {} wrong, {} reset; NEES {:.2f} "
        "{:.2f} {:.2f}\n",
        variant, s.n, s.started, s.soon, s.after / n, s.wrong, s.reset, s.p / n, s.yaw / n,
        s.v / n);
  }
}

void Table::writeCsv(std::ostream& out) {
  sort();
  if (!starts_.empty()) {
    out << "variant,clip,cut_s,started_after_s,scale,error_m,velocity_error_m_s,"
           "velocity_sigma_m_s,nees_position,nees_yaw,nees_velocity,wrong,reset\n";
    for (const StartRow& r : starts_) {
      out << fmt::format(
          "{},{},{:.2f},{:.2f},{:.3f},{:.3f},{:.3f},{:.3f},{:.2f},{:.2f},{:.2f},"
          "{},{}\n",
          r.variant, r.clip, r.cut_s, r.moving_s, r.scale, r.error_m, r.velocity_error,
          r.velocity_sigma, r.nees.position, r.nees.yaw, r.nees.velocity, static_cast<int>(r.wrong),
          static_cast<int>(r.reset));
    }
    return;
  }
  out << "clip,half,variant,length_m,ate_m,scale,rel_2m_percent,rel_5m_percent,rel_10m_percent,"
         "rel_50m_percent,nees_position,nees_yaw,nees_velocity,nees_in_band,nees_asked,first_s,"
         "cpu_ms,cpu_ms_p99,klt_ms,klt_ms_p99\n";
  for (const Row& r : rows_) {
    const Outcome& o = r.outcome;
    const NeesAt nees = meanOf(o.accuracy.nees);
    out << fmt::format(
        "{},{},{},{:.1f},{:.4f},{:.4f},{},{},{},{},{:.2f},{:.2f},{:.2f},{},{},{:.2f},{:.2f},{:.2f},"
        "{:.2f},{:.2f}\n",
        r.clip, nameOf(r.half), r.variant, o.accuracy.length_m, o.accuracy.ate_m, o.accuracy.scale,
        percent(o.accuracy.relative[0]), percent(o.accuracy.relative[1]),
        percent(o.accuracy.relative[2]), percent(o.accuracy.relative[3]), nees.position, nees.yaw,
        nees.velocity, o.accuracy.in_band, o.accuracy.asked, o.first_s, o.ms, o.ms_p99, o.klt_ms,
        o.klt_ms_p99);
  }
}

}  // namespace perdure::bench
