#include "common/camera/lens.h"

#include <algorithm>

namespace perdure {
namespace {

bool isOneOf(const std::string& name, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(), [&](const char* one) { return name == one; });
}

/// Sets Brown's model, which has four coefficients, five with k3, or eight (rational).
Result<void> setRadial(CameraCalibration& camera, std::vector<double> values) {
  while (values.size() > 8 && values.back() == 0.0)
    values.pop_back();  // thin prism and tilt terms that are zero
  if (values.size() != 4 && values.size() != 5 && values.size() != 8) {
    return fail("distortion_coefficients", "is missing or has not 4, 5 or 8 numbers");
  }
  while (values.size() > 4 && values.back() == 0.0) values.pop_back();
  camera.distortion = DistortionModel::kRadialTangential;
  if (values.size() > 4) {
    camera.distortion = DistortionModel::kRational;
    values.resize(8, 0.0);
  }
  camera.distortion_coefficients = std::move(values);
  return {};
}

}  // namespace

Result<void> setLens(CameraCalibration& camera, const std::string& model,
                     std::vector<double> values) {
  if (isOneOf(model, {"radial-tangential", "radtan", "plumb_bob", "brown", "rational_polynomial",
                      "rational"})) {
    return setRadial(camera, std::move(values));
  }
  if (isOneOf(model, {"equidistant", "equi", "fisheye", "kannala_brandt"})) {
    if (values.size() != 4) {
      return fail("distortion_coefficients", "is missing or has not 4 numbers");
    }
    camera.distortion = DistortionModel::kEquidistant;
    camera.distortion_coefficients = std::move(values);
    return {};
  }
  if (!isOneOf(model, {"", "none"})) {
    return fail("distortion_model", "is `" + model +
                                        "`; radial-tangential (radtan, plumb_bob), equidistant "
                                        "(equi) and none are known");
  }
  const bool any = std::any_of(values.begin(), values.end(), [](double d) { return d != 0.0; });
  if (!any) return {};
  return fail("distortion_model",
              model.empty() ? "is missing, but there are coefficients: write radial-tangential or "
                              "equidistant"
                            : "is none, but there are coefficients: write radial-tangential or "
                              "equidistant");
}

}  // namespace perdure
