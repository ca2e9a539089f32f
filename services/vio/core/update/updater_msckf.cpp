#include "services/vio/core/update/updater_msckf.h"

#include "services/vio/core/update/triangulation.h"
#include "services/vio/core/update/visual.h"

namespace perdure::vio {

Result<UpdateCounts> updateMsckf(State& state, const std::vector<const Track*>& tracks,
                                 const VisionOptions& options, ReasonCounts& reasons) {
  UpdateCounts counts;
  const std::vector<Block> blocks = calibrationAndClones(state);
  const Eigen::MatrixXd P = state.covarianceOf(blocks);
  std::vector<PointSystem> systems;
  Eigen::Index rows = 0;
  systems.reserve(tracks.size());
  for (const Track* const track : tracks) {
    const auto point = triangulate(raysOf(*track, state, options.sigma_px), options);
    if (!point) {
      if (point.error().code == "triangulation_depth") ++counts.behind;
      reasons.add(point.error());
      continue;
    }
    PointSystem s = stackViews(*track, state, point->p_W, options.sigma_px);
    if (s.r.size() < 4) continue;
    separatePoint(s);
    dropPoint(s);
    const auto of_views = [&] { return s.H_x * P * s.H_x.transpose(); };
    if (!passesGateWith(s.r, of_views, options.gate_probability)) {
      ++counts.gated;
      reasons.add("msckf_gated");
      continue;
    }
    ++counts.used;
    rows += s.r.size();
    systems.push_back(std::move(s));
  }
  if (rows == 0) return counts;
  Eigen::MatrixXd H(rows, P.cols());
  Eigen::VectorXd r(rows);
  Eigen::Index row = 0;
  for (const PointSystem& s : systems) {
    H.middleRows(row, s.r.size()) = s.H_x;
    r.segment(row, s.r.size()) = s.r;
    row += s.r.size();
  }
  compress(H, r);
  if (const auto done = state.update(H, blocks, r); !done) return tl::unexpected(done.error());
  return counts;
}

}  // namespace perdure::vio
