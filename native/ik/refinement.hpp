// Refines a configuration by the Levenberg-Marquardt method until its tool is at a pose.
#pragma once

#include <utility>

#include "ik/chain.hpp"

namespace mmp::ik {

struct RefinementSettings {
  int steps = 12;
  double farthest = 0;       // largest error to begin with [rad, or chain.scale]
  double tolerance = 1e-10;  // largest error of a refined configuration
  double longest = 1;        // longest motion of a joint in one step [rad or m]
  double damping = 1e-2;     // relative to the squared error: it vanishes with the error, so convergence is quadratic
  int patience = 5;          // steps before a configuration is given up whose error does not shrink ...
  double progress = 0.9;     // ... by this factor a step
};

// Solves a system of n equations in place by Gaussian elimination; the solution replaces `b`.
inline void solve(double* a, double* b, int n) {
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(a[i * n + k]) > std::abs(a[pivot * n + k])) pivot = i;
    if (pivot != k) {
      std::swap_ranges(a + k * n, a + k * n + n, a + pivot * n);
      std::swap(b[k], b[pivot]);
    }
    for (int i = k + 1; i < n; ++i) {
      const double factor = a[i * n + k] / a[k * n + k];
      for (int j = k; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
      b[i] -= factor * b[k];
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    for (int j = k + 1; j < n; ++j) b[k] -= a[k * n + j] * b[j];
    b[k] /= a[k * n + k];
  }
}

// Moves `q` by one step, J^T (J J^T + damping)^-1 error.
inline void take_step(const ToolTask& task, const ChainFrames& frames, double* error,
                      const RefinementSettings& settings, double* q) {
  const int rows = task.rows, dof = task.chain.dof();
  double slope[kMaxRows * kMaxDof], square[kMaxRows * kMaxRows], squared = 0;
  task.slope(frames, slope);
  for (int i = 0; i < rows; ++i) squared += error[i] * error[i];
  const double damping = settings.damping * std::min(squared, 1.0) + 1e-14;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < rows; ++j) {
      double sum = i == j ? damping : 0.0;
      for (int k = 0; k < dof; ++k) sum += slope[i * dof + k] * slope[j * dof + k];
      square[i * rows + j] = sum;
    }
  solve(square, error, rows);
  double step[kMaxDof], longest = 1e-12;
  for (int k = 0; k < dof; ++k) {
    step[k] = 0;
    for (int i = 0; i < rows; ++i) step[k] += slope[i * dof + k] * error[i];
    longest = std::max(longest, std::abs(step[k]));
  }
  for (int k = 0; k < dof; ++k) q[k] += step[k] * std::min(1.0, settings.longest / longest);
}

// Returns whether the configuration `q` [rad or m], which is refined in place, has the tool at the pose.
inline bool refine(const ToolTask& task, const ToolPose& pose, const RefinementSettings& settings, double* q) {
  double best = 0, error[kMaxRows];
  for (int step = 0;; ++step) {
    const ChainFrames frames(task.chain, q);
    task.error(frames, pose, error);
    double squared = 0;
    for (int i = 0; i < task.rows; ++i) squared += error[i] * error[i];
    const double size = std::sqrt(squared);
    if (size < settings.tolerance) return true;
    if (!(size <= (step == 0 ? settings.farthest : 1e9)) || step == settings.steps) return false;
    if (step > settings.patience && size > settings.progress * best && size > 1e-6) return false;
    best = step == 0 ? size : std::min(best, size);
    take_step(task, frames, error, settings, q);
  }
}

}  // namespace mmp::ik
