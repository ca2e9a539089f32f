#include "common/replay/files/kitti_calibration.h"

#include <map>
#include <vector>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

/// `name: numbers` or, as the official tracking files partly do, `name numbers`.
class Entries {
 public:
  Entries(const std::filesystem::path& file, std::string_view mend) : file_(file) {
    for (const auto& line : readLines(file, mend)) {
      const auto fields = split(line.text, ' ');
      std::string name(fields[0]);
      if (name.ends_with(':')) name.pop_back();
      const auto numbers = parseNumbers({fields.begin() + 1, fields.end()});
      if (numbers) entries_[name] = *numbers;  // times of calibration and the like are not numbers
    }
  }

  bool has(const std::string& name) const { return entries_.contains(name); }

  /// The entry of one of the names with `count` numbers.
  const std::vector<double>& get(const std::vector<std::string>& names, std::size_t count) const {
    for (const auto& name : names) {
      const auto found = entries_.find(name);
      if (found == entries_.end()) continue;
      if (found->second.size() == count) return found->second;
      throw StartupError(ExitCode::kUnavailable, file_.string() + ": " + name + " has " +
                                                     std::to_string(found->second.size()) +
                                                     " numbers, not " + std::to_string(count) +
                                                     "; fetch KITTI's calibration file again");
    }
    throw StartupError(ExitCode::kUnavailable, file_.string() + ": " + names.front() +
                                                   " is missing; fetch KITTI's calibration again");
  }

  ProjectionMatrix projection(const std::vector<std::string>& names) const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(get(names, 12).data());
  }
  Eigen::Matrix3d rotation(const std::vector<std::string>& names) const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(get(names, 9).data());
  }
  RigidTransform transform(const std::vector<std::string>& names) const {
    const ProjectionMatrix m = projection(names);
    return RigidTransform(Eigen::Matrix3d(m.leftCols<3>()), Eigen::Vector3d(m.col(3)));
  }
  RigidTransform rotationAndTranslation() const {
    return RigidTransform(rotation({"R"}), Eigen::Vector3d(get({"T"}, 3).data()));
  }

 private:
  std::filesystem::path file_;
  std::map<std::string, std::vector<double>> entries_;
};

}  // namespace

CameraCalibration KittiCalibration::camera(const std::string& name) const {
  const ProjectionMatrix& P = name == "cam1" ? P3 : P2;
  CameraCalibration camera;
  camera.name = name;
  camera.width = width, camera.height = height;
  camera.fx = P(0, 0), camera.fy = P(1, 1), camera.cx = P(0, 2), camera.cy = P(1, 2);
  // P = K [I | t] with t the origin of the rectified camera 0 in this camera.
  const Eigen::Vector3d t = P.leftCols<3>().inverse() * P.col(3);
  const RigidTransform T_CR(Eigen::Quaterniond::Identity(), t);
  camera.T_BC = (T_CR * T_RI).inverse();
  camera.rate_hz = 10.0;
  return camera;
}

KittiCalibration readTrackingCalibration(const std::filesystem::path& file) {
  const Entries entries(file, "KITTI tracking keeps calib/SEQUENCE.txt in its root");
  KittiCalibration calibration;
  calibration.P2 = entries.projection({"P2"});
  calibration.P3 = entries.projection({"P3"});
  const RigidTransform rectify(entries.rotation({"R0_rect", "R_rect"}), Eigen::Vector3d::Zero());
  calibration.T_RI = rectify * entries.transform({"Tr_velo_to_cam", "Tr_velo_cam"}) *
                     entries.transform({"Tr_imu_to_velo", "Tr_imu_velo"});
  return calibration;
}

KittiCalibration readRawCalibration(const std::filesystem::path& folder) {
  const std::string mend = "unpack KITTI's calibration of that day beside or above the drive";
  const Entries cameras(folder / "calib_cam_to_cam.txt", mend);
  const Entries velo(folder / "calib_velo_to_cam.txt", mend);
  const Entries imu(folder / "calib_imu_to_velo.txt", mend);
  KittiCalibration calibration;
  calibration.P2 = cameras.projection({"P_rect_02"});
  calibration.P3 = cameras.projection({"P_rect_03"});
  const RigidTransform rectify(cameras.rotation({"R_rect_00"}), Eigen::Vector3d::Zero());
  calibration.T_RI = rectify * velo.rotationAndTranslation() * imu.rotationAndTranslation();
  const auto& size = cameras.get({"S_rect_02"}, 2);
  calibration.width = static_cast<std::uint32_t>(size[0]);
  calibration.height = static_cast<std::uint32_t>(size[1]);
  return calibration;
}

ImageSize trackingImageSize(const std::string& sequence) {
  const auto number = parseInteger(sequence).value_or(0);
  if (number >= 14 && number <= 17) return {1224, 370};
  if (number == 18 || number == 19) return {1238, 374};
  if (number == 20) return {1241, 376};
  return {};
}

}  // namespace perdure::replay
