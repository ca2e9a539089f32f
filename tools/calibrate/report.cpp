// Writes calibration.json: all estimates, their uncertainty and their judgements.
#include <nlohmann/json.hpp>

#include "tools/calibrate/calibrate.h"

namespace perdure::calibrate {
namespace {

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
