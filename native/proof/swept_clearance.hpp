// The clearance of a moving arm from a body that is not in its cell, at every instant.
#pragma once

#include "geometry/cell.hpp"

namespace mmp {

// Writes for each straight segment between rows of q [n][dof] a lower bound of the distance between the moving links of
// arm a and the body [m]. The arm may stray from the segments by `stray` in every joint.
inline void swept_clearance(const Cell& cell, int a, const double* q, size_t n, const Obstacle<double>& body,
                            double stray, double* out) {
  using V = Doubles;
  const auto& arm = cell.precise.arms[a];
  Pose<V> pose(arm);
  Sweep<V> sweep;
  V middle[kMaxDof], half[kMaxDof];
  for (size_t k = 0; k + 1 < n; k += width<V>) {
    for (int lane = 0; lane < width<V>; ++lane) {
      const double* from = q + std::min(k + lane, n - 2) * arm.dof;
      for (int j = 0; j < arm.dof; ++j) {
        half[j][lane] = (from[arm.dof + j] - from[j]) / 2;
        middle[j][lane] = from[j] + half[j][lane];
      }
    }
    forward(middle, pose);
    sweep.set(pose, middle, half);
    V best = splat<V>(kFar);
    for (int l = static_cast<int>(arm.links.size()) - 1; l >= 1; --l) {
      V levers{};
      for (int j = 0; j < arm.links[l].frame; ++j) levers += sweep.beyond + arm.lever[l][j];
      const V reach = sweep.reach(pose, l) + stray * levers;
      V clearance = best + reach;
      lower_clearance(pose, l, body, clearance);
      best = min(best, clearance - reach);
    }
    store_lanes(best, out, n - 1, k);
  }
}

}  // namespace mmp
