#include "common/replay/files/kitti_calibration.h"

#include <Eigen/LU>
#include <map>
#include <vector>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

/// The entries of a file by name. A line is `name: numbers` or `name numbers`, because the official
/// tracking files use both.
class Entries {
 public:
  Entries(const std::filesystem::path& file, std::string_view fix) : file_(file) {
    for (const auto& line : readLines(file, fix)) {
      const auto fields = split(line.text, ' ');
      std::string name(fields[0]);
      if (name.ends_with(':')) name.pop_back();
      const auto numbers = parseNumbers({fields.begin() + 1, fields.end()});
      if (numbers) entries_[name] = *numbers;  // skips dates
    }
  }

  bool has(const std::string& name) const { return entries_.contains(name); }

  /// Returns the entry with `count` numbers under one of the names.
  const std::vector<double>& get(const std::vector<std::string>& names, std::size_t count) const {
    for (const auto& name : names) {
      const auto found = entries_.find(name);
      if (found == entries_.end()) continue;
      if (found->second.size() == count) return found->second;
      throw StartupError(ExitCode::kData, file_.string() + ": " + name + " has " +
                                              std::to_string(found->second.size()) +
                                              " numbers, not " + std::to_string(count) +
                                              "; fetch KITTI's calibration file again");
    }
    throw StartupError(ExitCode::kUnavailable, file_.string() + ": " + names.front() +
                                                   " is missing; fetch KITTI's calibration again");
  }

  /// Returns a camera's projection matrix P = K [I | t], with t in metres. Focal lengths in K must
  /// be 1 to 1e6 pixels.
  ProjectionMatrix projection(const std::string& name) const {
    const ProjectionMatrix P = matrix({name});
    const bool focal = P(0, 0) >= 1.0 && P(1, 1) >= 1.0 && P.cwiseAbs().maxCoeff() <= 1e6;
    if (!focal || P(1, 0) != 0.0 || !P.row(2).head<3>().isApprox(Eigen::RowVector3d(0, 0, 1))) {
      wrong(name, "is no projection of a rectified camera");
    }
    return P;
  }
  Eigen::Matrix3d rotation(const std::vector<std::string>& names) const {
    return checked(names, Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
                              get(names, 9).data()));
  }
  RigidTransform transform(const std::vector<std::string>& names) const {
    const ProjectionMatrix m = matrix(names);
    return RigidTransform(checked(names, m.leftCols<3>()), Eigen::Vector3d(m.col(3)));
  }
  RigidTransform rotationAndTranslation() const {
    return RigidTransform(rotation({"R"}), Eigen::Vector3d(get({"T"}, 3).data()));
  }
  /// Returns one number of the image size, in pixels.
  std::uint32_t size(const std::string& name, std::size_t index) const {
    const double pixels = get({name}, 2)[index];
    if (!(pixels >= 1.0 && pixels <= 65535.0)) wrong(name, "is no size of an image");
    return static_cast<std::uint32_t>(pixels);
  }

 private:
  ProjectionMatrix matrix(const std::vector<std::string>& names) const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(get(names, 12).data());
  }
  Eigen::Matrix3d checked(const std::vector<std::string>& names, const Eigen::Matrix3d& R) const {
    if (!isRotation(R)) wrong(names.front(), "is no rotation");
    return R;
  }
  [[noreturn]] void wrong(const std::string& name, const std::string& what) const {
    throw StartupError(ExitCode::kData, file_.string() + ": " + name + " " + what +
                                            "; fetch KITTI's calibration file again");
  }

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
  // In P = K [I | t], t is the origin of the rectified camera 0 in this camera.
  const Eigen::Vector3d t = P.leftCols<3>().inverse() * P.col(3);
  const RigidTransform T_CR(Eigen::Quaterniond::Identity(), t);
  camera.T_BC = (T_CR * T_RI).inverse();
  camera.rate_hz = 10.0;
  return camera;
}

KittiCalibration readTrackingCalibration(const std::filesystem::path& file) {
  const Entries entries(file, "KITTI tracking keeps calib/SEQUENCE.txt in its root");
  KittiCalibration calibration;
  calibration.P2 = entries.projection("P2");
  calibration.P3 = entries.projection("P3");
  const RigidTransform rectify(entries.rotation({"R0_rect", "R_rect"}), Eigen::Vector3d::Zero());
  calibration.T_RI = rectify * entries.transform({"Tr_velo_to_cam", "Tr_velo_cam"}) *
                     entries.transform({"Tr_imu_to_velo", "Tr_imu_velo"});
  return calibration;
}

KittiCalibration readRawCalibration(const std::filesystem::path& folder) {
  const std::string fix = "unpack KITTI's calibration of that day beside or above the drive";
  const Entries cameras(folder / "calib_cam_to_cam.txt", fix);
  const Entries velo(folder / "calib_velo_to_cam.txt", fix);
  const Entries imu(folder / "calib_imu_to_velo.txt", fix);
  KittiCalibration calibration;
  calibration.P2 = cameras.projection("P_rect_02");
  calibration.P3 = cameras.projection("P_rect_03");
  const RigidTransform rectify(cameras.rotation({"R_rect_00"}), Eigen::Vector3d::Zero());
  calibration.T_RI = rectify * velo.rotationAndTranslation() * imu.rotationAndTranslation();
  calibration.width = cameras.size("S_rect_02", 0);
  calibration.height = cameras.size("S_rect_02", 1);
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
