// Projection of configurations onto the bound of an upright tool (Berenson, Srinivasa, Ferguson, Kuffner: Manipulation
// Planning on Constraint Manifolds, ICRA 2009).
#pragma once

#include <optional>

#include "geometry/upright.hpp"

namespace mmp {

// Longest move of a joint [rad] in one step of a tree, over the square root of the bound: the angle deviates from that
// of the ends with the square of the step.
inline constexpr double kUprightStep = 0.6;
// Least progress of a step to a projected configuration, relative to the step.
inline constexpr double kLeastProgress = 0.1;

// Newton steps of one arm's configuration that reduce the angle of its tool axis. Without a bound it does nothing.
template <class V>
class UprightProjection {
 public:
  using T = Scalar<V>;
  explicit UprightProjection(const ArmModel<T>& arm) : arm_(&arm) {
    if (!arm.upright) return;
    pose_.emplace(arm);
    const double bound = arm.upright->angle;
    accepted_ = upright_within<T>({}, kAccepted * bound);
    aim_ = upright_within<T>({}, kAim * bound);
    longest_step_ = T(kUprightStep * std::sqrt(bound));
  }

  bool is_bound() const { return pose_.has_value(); }
  // Longest move of a joint in a step of a tree [rad]; unlimited without a bound.
  T longest_step() const { return longest_step_; }

  // Moves the configuration inside the bound, within the joint limits. Returns false if that fails.
  bool operator()(T* q) {
    if (!is_bound()) return true;
    for (int it = 0; it < kSteps; ++it) {
      V joints[kMaxDof];
      for (int j = 0; j < arm_->dof; ++j) joints[j] = splat<V>(q[j]);
      forward(joints, *pose_);
      const auto axis = tool_axis(*pose_);
      if (upright_room<V>(accepted_, axis)[0] >= T(0)) return true;
      if (!step(axis.x[0], axis.y[0], axis.z[0], q)) return false;
    }
    return false;
  }

 private:
  static constexpr int kSteps = 12;
  static constexpr double kAccepted = 0.85, kAim = 0.7;        // angles that are accepted and aimed at, over the bound
  static constexpr double kTurn = 0.8, kLeastGradient = 1e-4;  // largest turn of a step [rad]

  // Turns the axis towards z by the smallest move of the joints (L2), all of them within their limits.
  bool step(T x, T y, T z, T* q) const {
    const T across = std::sqrt(x * x + y * y);
    const T turn_x = across > T(1e-6) ? y / across : T(1), turn_y = across > T(1e-6) ? -x / across : T(0);
    const T sine = across * aim_.cosine - z * aim_.sine, cosine = z * aim_.cosine + across * aim_.sine;
    const T turn = cosine > T(0) ? std::min(sine, T(kTurn)) : T(kTurn);
    T gradient[kMaxDof], sum = 0;
    for (int j = 0; j < arm_->dof; ++j) {
      const auto& r = pose_->frames[j + 1].r;
      const T g = arm_->slides(j) ? T(0) : r[2][0] * turn_x + r[5][0] * turn_y;
      const bool stuck = g > T(0) ? q[j] >= arm_->upper[j] : q[j] <= arm_->lower[j];
      gradient[j] = stuck ? T(0) : g;
      sum += gradient[j] * gradient[j];
    }
    if (sum < T(kLeastGradient)) return false;
    for (int j = 0; j < arm_->dof; ++j)
      q[j] = std::clamp(q[j] + turn * gradient[j] / sum, arm_->lower[j], arm_->upper[j]);
    return true;
  }

  const ArmModel<T>* arm_;
  std::optional<Pose<V>> pose_;
  Upright<T> accepted_{}, aim_{};
  T longest_step_ = T(1e9);
};

}  // namespace mmp
