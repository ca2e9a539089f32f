// Beliefs, working sets and a temporary folder for the tests of map_store.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "common/types/objects.h"

namespace perdure::map_store::test {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "perdure-map-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string file(const std::string& name) const { return (path_ / name).string(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline ClassBelief classBelief(const std::string& name, double probability,
                               const Eigen::Vector3d& p, std::mt19937& random) {
  std::normal_distribution<double> normal;
  ClassBelief belief;
  belief.name = name;
  belief.probability = probability;
  belief.mean << p, 0.3, std::log(4.2), std::log(1.7), std::log(1.5);
  const auto noise = [&] { return normal(random); };
  const Matrix7d root = Matrix7d::NullaryExpr(noise);
  belief.covariance = root * root.transpose();
  belief.cross_pose = Eigen::Matrix<double, 7, 6>::NullaryExpr(noise);
  return belief;
}

inline ObjectBelief carAt(ObjectId id, const Eigen::Vector3d& p, const std::string& name = "car") {
  std::mt19937 random(static_cast<std::uint32_t>(id));
  ObjectBelief belief;
  belief.id = id;
  belief.existence = 0.97;
  belief.confirmed = true;
  belief.classes = {classBelief(name, 0.9, p, random),
                    classBelief(kOtherClass, 0.1, p + Eigen::Vector3d(1, 0, 0), random)};
  belief.first_seen = fromNanoseconds(1'000'000'000);
  belief.last_seen = fromNanoseconds(2'000'000'000 + static_cast<std::int64_t>(id));
  belief.as_of = belief.last_seen;
  belief.hits = 7;
  belief.visible_fraction = 0.625;
  belief.why.existence.resize(kExistenceEvidences);
  belief.why.existence[0] = {-1.5, 1, belief.first_seen, belief.first_seen};
  belief.why.existence[1] = {logOdds(belief.existence) + 1.5, 7, belief.first_seen,
                             belief.last_seen};
  belief.why.classes = {{name, {-0.25, std::log(0.9) + 0.25}}, {kOtherClass, {std::log(0.1)}}};
  belief.why.ousted = {{"van", name, belief.first_seen, {0.5, 0.75, 1.5}}};
  return belief;
}

inline Objects workingSet(std::uint64_t sequence, std::vector<ObjectBelief> beliefs,
                          InstanceId filter = 11) {
  Objects objects;
  objects.stamp = {42, sequence, fromNanoseconds(100'000'000 * static_cast<std::int64_t>(sequence)),
                   0};
  objects.instance = filter;
  objects.world = {77, 1};
  objects.next_id = 1;
  for (const auto& belief : beliefs) objects.next_id = std::max(objects.next_id, belief.id + 1);
  objects.objects = std::move(beliefs);
  return objects;
}

}  // namespace perdure::map_store::test
