#include "tools/calibrate/calibrate.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "tools/simulate/writer.h"

namespace perdure::calibrate {
namespace {

DistortionModel modelOf(const CalibrateOptions& options, const CameraCalibration& prior) {
  const bool tells = prior.fx > 0.0 && prior.distortion != DistortionModel::kNone;
  // A rational lens can be read but not estimated, so that Brown's model replaces it.
  const bool radial = !tells || prior.distortion == DistortionModel::kRational;
  return options.lens.value_or(radial ? DistortionModel::kRadialTangential : prior.distortion);
}

/// The IMU noise of the recording, else that of vio's default configuration.
ImuCalibration noiseOf(const CalibrationDrive& drive) {
  constexpr ImuCalibration kUsual{1.7e-4, 2e-5, 2e-3, 3e-3, 200.0};
  const bool tells = drive.imu && drive.imu->gyro_noise > 0.0 && drive.imu->accel_noise > 0.0;
  return tells ? *drive.imu : kUsual;
}

/// Returns the value of `result`. Throws StartupError if `result` failed.
template <class T>
T must(Result<T> result, const std::string& camera) {
  if (!result) {
    throw StartupError(ExitCode::kUnavailable,
                       camera + ": " + result.error().detail + " (" + result.error().code + ")");
  }
  return *std::move(result);
}

CalibratedCamera calibrateCamera(const CalibrationDrive& drive, const CameraViews& seen,
                                 const CalibrateOptions& options) {
  CalibratedCamera camera;
  camera.seen = seen;
  camera.lens = must(
      estimateIntrinsics(options.board, seen.views, seen.prior, {modelOf(options, seen.prior), 60}),
      seen.prior.name);
  camera.judgements = judgeLens(camera.lens, seen);
  if (options.intrinsics_only) {
    camera.judgements.push_back(judgeCoverage(camera.lens.camera, camera.lens.residuals));
    return camera;
  }
  CameraImuInput input;
  input.board = options.board, input.views = seen.views, input.samples = drive.samples;
  input.camera = camera.result();
  input.imu = noiseOf(drive);
  input.sigma_px = camera.lens.sigma_px;
  camera.place = must(estimateCameraImu(input, options.place), seen.prior.name);
  camera.judgements.push_back(judgeCoverage(camera.place->camera, camera.place->residuals));
  const Judgements more = judgePlace(*camera.place, seen.prior);
  camera.judgements.insert(camera.judgements.end(), more.begin(), more.end());
  return camera;
}

using nlohmann::json;

json listOf(const Eigen::VectorXd& v) { return std::vector<double>(v.data(), v.data() + v.size()); }

json matrixOf(const Eigen::MatrixXd& m) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) rows.push_back(listOf(m.row(i).transpose()));
  return rows;
}

json judgementsOf(const Judgements& judgements) {
  json all = json::array();
  for (const auto& j : judgements) all.push_back({{"grade", wordOf(j.grade)}, {"text", j.text}});
  return all;
}

json cellsJson(const CameraCalibration& camera, const std::vector<CornerResidual>& residuals) {
  json rows = json::array();
  for (const Cell& cell : cellsOf(camera, residuals)) {
    rows.push_back({{"corners", cell.corners}, {"mean_px", listOf(cell.mean)}});
  }
  return {{"columns", kCellColumns}, {"rows", kCellRows}, {"cells", rows}};
}

json placeJson(const CameraImu& place) {
  const Eigen::Quaterniond& q = place.camera.T_BC.q;
  return {{"q_BC_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"p_BC_m", listOf(place.camera.T_BC.p)},
          {"time_offset_s", place.camera.time_offset_s},
          {"covariance_of",
           "rotation (rad, right of R_BC), p_BC (m), time offset (s), fx fy cx cy, "
           "distortion coefficients"},
          {"covariance", matrixOf(place.covariance)},
          {"covariance_widened_by", place.widened},
          {"gyro_bias", listOf(place.gyro_bias)},
          {"gyro_bias_sigma", listOf(place.gyro_bias_sigma)},
          {"accel_bias", listOf(place.accel_bias)},
          {"accel_bias_sigma", listOf(place.accel_bias_sigma)},
          {"gravity_in_board", listOf(place.gravity_T)},
          {"knot_interval_s", place.knot_interval_s},
          {"seconds", place.to_s - place.from_s},
          {"views", place.views},
          {"corners", place.corners},
          {"outliers", place.outliers},
          {"samples", place.samples},
          {"corner_sigma_px", place.sigma_px},
          {"gyro_noise", {{"ratio", place.gyro.ratio}, {"correlation", place.gyro.correlation}}},
          {"accel_noise", {{"ratio", place.accel.ratio}, {"correlation", place.accel.correlation}}},
          {"rate_rms", listOf(place.rate_rms_B)},
          {"accel_rms", listOf(place.accel_rms_B)},
          {"residuals", cellsJson(place.camera, place.residuals)}};
}

json lensJson(const Intrinsics& lens) {
  return {{"estimate", listOf(lensOf(lens.camera))},
          {"of", "fx fy cx cy, distortion coefficients"},
          {"covariance", matrixOf(lens.covariance)},
          {"views", lens.views},
          {"corners", lens.corners},
          {"outliers", lens.outliers},
          {"corner_sigma_px", lens.sigma_px},
          {"residuals", cellsJson(lens.camera, lens.residuals)}};
}

}  // namespace

CameraCalibration CalibratedCamera::result() const {
  CameraCalibration camera = seen.prior;
  const CameraCalibration& from = place ? place->camera : lens.camera;
  camera.distortion = from.distortion;
  setLens(lensOf(from), camera);
  if (place) camera.T_BC = from.T_BC, camera.time_offset_s = from.time_offset_s;
  return camera;
}

Judgements Calibrated::all() const {
  Judgements together;
  for (const auto& camera : cameras) {
    together.insert(together.end(), camera.judgements.begin(), camera.judgements.end());
  }
  return together;
}

Calibrated calibrate(const CalibrationDrive& drive, const CalibrateOptions& options) {
  Calibrated calibrated{options.board, {}, {}};
  for (const CameraViews& seen : drive.cameras) {
    calibrated.cameras.push_back(calibrateCamera(drive, seen, options));
    calibrated.rig.cameras.push_back(calibrated.cameras.back().result());
  }
  calibrated.rig.imu = drive.imu;
  return calibrated;
}

void writeCalibrated(const Calibrated& calibrated, const std::filesystem::path& folder) {
  const std::string comment = fmt::format(
      "Calibrated with {}: {}.\ncalibration.json beside it has covariances and residuals.",
      calibrated.board.text(), summaryOf(calibrated.all()));
  tools::writeWhole(folder / "rig.yaml", replay::rigText(calibrated.rig, comment));
  tools::writeWhole(folder / "calibration.json", reportText(calibrated));
  for (const auto& camera : calibrated.cameras) {
    drawResiduals(camera, folder / ("residuals_" + camera.seen.prior.name + ".png"));
  }
}

std::string reportText(const Calibrated& calibrated) {
  json report = {{"board", calibrated.board.text()},
                 {"verdict", wordOf(worstOf(calibrated.all()))},
                 {"summary", summaryOf(calibrated.all())},
                 {"cameras", json::object()}};
  for (const auto& camera : calibrated.cameras) {
    json one = {{"images", camera.seen.images},
                {"images_with_board", camera.seen.views.size()},
                {"judgements", judgementsOf(camera.judgements)},
                {"lens_alone", lensJson(camera.lens)}};
    if (camera.place) one["camera_imu"] = placeJson(*camera.place);
    report["cameras"][camera.seen.prior.name] = one;
  }
  return report.dump(2) + "\n";
}

}  // namespace perdure::calibrate
