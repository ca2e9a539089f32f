#include "tools/evaluate/consistency_score.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/math/chi2.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "common/replay/files/text_file.h"

namespace perdure::tools {
namespace {

constexpr double kPi = std::numbers::pi;

MapBelief beliefOf(const nlohmann::json& json) {
  MapBelief belief;
  belief.id = json.at("id");
  belief.class_name = json.at("class");
  belief.existence = json.at("existence");
  belief.moving = json.at("moving");
  belief.last_seen = fromNanoseconds(json.at("last_seen_ns"));
  const auto& gaussian = json.at("classes").at(belief.class_name);
  for (std::size_t i = 0; i < 7; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    belief.mean[row] = gaussian.at("mean").at(i);
    for (std::size_t j = 0; j < 7; ++j) {
      belief.covariance(row, static_cast<Eigen::Index>(j)) = gaussian.at("covariance").at(i).at(j);
    }
  }
  return belief;
}

/// The nearest static true object of the belief's class that existed when the belief was last seen.
std::optional<std::size_t> partnerOf(const MapBelief& belief, const sim::Truth& truth,
                                     const RigidTransform& T_WT, double within) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < truth.objects.size(); ++i) {
    const auto& object = truth.objects[i];
    if (object.moves || object.class_name != belief.class_name) continue;
    if (!object.presentAt(belief.last_seen)) continue;
    const Eigen::Vector3d place = T_WT * object.at(belief.last_seen).centre_W;
    const double distance = (place - belief.mean.head<3>()).norm();
    if (distance < within) within = distance, best = i;
  }
  return best;
}

void compare(const MapBelief& belief, const sim::TruthObject& object, const RigidTransform& T_WT,
             ConsistencyScore& score) {
  const sim::TruthKey key = object.at(belief.last_seen);
  Vector7d truth;
  truth << T_WT * key.centre_W, wrapAngle(key.yaw + yawOf(T_WT.R())),
      Eigen::Vector3d(object.size.array().log());
  const Vector7d error = belief.mean - truth;
  const auto part = [&](Eigen::Index from) {
    const Eigen::Vector3d e = error.segment<3>(from);
    return e.dot(belief.covariance.block<3, 3>(from, from).ldlt().solve(e));
  };
  const double turn = wrapAngle(error[3]), half = 0.5 * wrapAngle(2.0 * turn);
  score.position.nees.push_back(part(0));
  score.yaw.nees.push_back(turn * turn / belief.covariance(3, 3));
  score.half_yaw.nees.push_back(half * half / belief.covariance(3, 3));
  score.size.nees.push_back(part(4));
}

}  // namespace

std::vector<MapBelief> readBeliefs(const std::filesystem::path& file) {
  constexpr char kFix[] = "`perdure pipeline` writes it";
  std::ifstream stream(file);
  if (!stream) {
    throw StartupError(ExitCode::kUnavailable, "{} cannot be read; {}", file.string(), kFix);
  }
  std::vector<MapBelief> beliefs;
  try {
    const auto root = nlohmann::json::parse(stream);
    for (const auto& object : root.at("objects")) beliefs.push_back(beliefOf(object));
  } catch (const nlohmann::json::exception& error) {
    throw StartupError(ExitCode::kData, fmt::format("{} is no objects.json ({}); {}", file.string(),
                                                    error.what(), kFix));
  }
  return beliefs;
}

std::vector<OdometryRow> readOdometry(const std::filesystem::path& file) {
  constexpr std::size_t kFields = 4 + 7 + 9 + 45;
  const auto lines = replay::readLines(file, "`perdure pipeline` writes it");
  std::vector<OdometryRow> rows;
  for (const replay::TextLine& line : lines) {
    if (line.text.starts_with("frame,")) continue;
    const auto fields = replay::split(line.text, ',');
    const auto v = fields.size() == kFields
                       ? replay::parseNumbers({fields.begin() + 2, fields.end()})
                       : std::nullopt;
    const auto time = v ? replay::parseInteger(fields[1]) : std::nullopt;
    if (!time) {
      throw StartupError(ExitCode::kData,
                         fmt::format("{}:{}: no line of odometry.csv; `perdure pipeline` writes it",
                                     file.string(), line.number));
    }
    const auto at = [&](std::size_t i) { return (*v)[i]; };
    OdometryRow row;
    row.time = fromNanoseconds(*time);
    row.epoch = static_cast<std::uint64_t>(at(0));
    row.T_WB = RigidTransform(Eigen::Quaterniond(at(8), at(5), at(6), at(7)).normalized(),
                              Eigen::Vector3d(at(2), at(3), at(4)));
    row.v_WB = {at(9), at(10), at(11)};
    std::size_t k = 18;
    for (Eigen::Index i = 0; i < 9; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j, ++k) {
        row.covariance(i, j) = row.covariance(j, i) = at(k);
      }
    }
    rows.push_back(row);
  }
  return rows;
}

RigidTransform placedOn(const RigidTransform& T_WB, const RigidTransform& true_T_WB) {
  const Eigen::Matrix3d M = T_WB.R() * true_T_WB.R().transpose();
  const Eigen::Matrix3d R = rotationAboutZ(std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1)));
  return RigidTransform(R, Eigen::Vector3d(T_WB.p - R * true_T_WB.p));
}

OdometryScore scoreOdometry(const std::vector<OdometryRow>& rows, const replay::PoseFile& truth) {
  constexpr Duration kStep = std::chrono::milliseconds(10);
  OdometryScore score;
  std::optional<RigidTransform> T_WT;
  std::uint64_t epoch = 0;
  for (const OdometryRow& row : rows) {
    const auto before = truth.at(0, row.time - kStep), after = truth.at(0, row.time + kStep);
    const auto now = truth.at(0, row.time);
    if (!before || !now || !after) continue;
    if (!T_WT || row.epoch != epoch) {
      T_WT = placedOn(row.T_WB, *now);
      epoch = row.epoch;
    }
    const RigidTransform T_WB = *T_WT * *now;
    const Eigen::Vector3d v = T_WT->R() * (after->p - before->p) / (2.0 * toSeconds(kStep));
    const auto nees = [&](const Eigen::Vector3d& error, Eigen::Index at) {
      return squaredMahalanobis(error, row.covariance.block<3, 3>(at, at));
    };
    score.orientation.nees.push_back(nees(logSo3(row.T_WB.q.conjugate() * T_WB.q), 0));
    score.position.nees.push_back(nees(T_WB.p - row.T_WB.p, 3));
    score.velocity.nees.push_back(nees(v - row.v_WB, 6));
  }
  return score;
}

double Anees::mean() const {
  double sum = 0.0;
  for (const double value : nees) sum += value;
  return nees.empty() ? 0.0 : sum / (static_cast<double>(nees.size()) * dof);
}

double Anees::median() const { return medianOf(nees); }

double Anees::within3Sigma() const {
  constexpr double kShare = 0.9973;
  const double limit = chi2Quantile(kShare, dof);
  const auto inside = std::ranges::count_if(nees, [&](double value) { return value <= limit; });
  return nees.empty() ? 1.0 : static_cast<double>(inside) / static_cast<double>(nees.size());
}

std::pair<double, double> Anees::band() const {
  const int n = dof * static_cast<int>(nees.size());
  if (n == 0) return {0.0, 0.0};
  return {chi2Quantile(0.025, n) / n, chi2Quantile(0.975, n) / n};
}

void RunAnees::add(const Anees& run) {
  if (!run.nees.empty()) means.push_back(run.mean());
}

double RunAnees::mean() const {
  double sum = 0.0;
  for (const double value : means) sum += value;
  return means.empty() ? 0.0 : sum / static_cast<double>(means.size());
}

double RunAnees::standardError() const {
  if (means.size() < 2) return 0.0;
  double sum = 0.0;
  for (const double value : means) sum += (value - mean()) * (value - mean());
  const auto n = static_cast<double>(means.size());
  return std::sqrt(sum / (n - 1.0) / n);
}

std::pair<double, double> RunAnees::band() const {
  const int n = dof * static_cast<int>(means.size());
  if (n == 0) return {0.0, 0.0};
  return {chi2Quantile(0.025, n) / n, chi2Quantile(0.975, n) / n};
}

ConsistencyScore scoreConsistency(const std::vector<MapBelief>& beliefs, const sim::Truth& truth,
                                  const RigidTransform& T_WT, double within) {
  std::map<std::size_t, std::pair<double, const MapBelief*>> nearest;  // key: true object
  ConsistencyScore score;
  std::uint64_t asked = 0;
  for (const auto& belief : beliefs) {
    if (belief.class_name == kOtherClass || belief.existence <= 0.5) continue;
    ++asked;
    const auto partner =
        belief.moving > 0.5 ? std::nullopt : partnerOf(belief, truth, T_WT, within);
    if (!partner) continue;
    const Eigen::Vector3d place = T_WT * truth.objects[*partner].at(belief.last_seen).centre_W;
    const double distance = (place - belief.mean.head<3>()).norm();
    const auto found = nearest.find(*partner);
    if (found == nearest.end() || distance < found->second.first) {
      nearest[*partner] = {distance, &belief};
    }
  }
  for (const auto& [object, pair] : nearest) {
    compare(*pair.second, truth.objects[object], T_WT, score);
  }
  score.objects = nearest.size();
  score.left_out = asked - score.objects;
  return score;
}

}  // namespace perdure::tools
