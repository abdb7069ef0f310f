// Bound on the angle between a tool axis and the world's z axis.
//
// Around z, with the tool's origin as its apex, lies a cone whose half angle is the bound. The room of a pose is the
// signed distance of the point at 1 m on the tool axis from the tangent plane of the cone that is nearest:
// sin(bound - angle), positive inside. So it is tested like a clearance [m].
#pragma once

#include "geometry/collision.hpp"

namespace mmp {

// `axis`: unit vector in the last frame. `angle`: from 0 to a right angle [rad].
template <class T>
Upright<T> upright_within(const std::array<double, 3>& axis, double angle) {
  Doubles sine, cosine;  // not those of the C library, whose last bit depends on the processor
  sincos<Doubles>(splat<Doubles>(angle), sine, cosine);
  return {{T(axis[0]), T(axis[1]), T(axis[2])}, T(angle), T(sine[0]), T(cosine[0])};
}

template <class V>
MMP_INLINE V upright_room(const Upright<Scalar<V>>& bound, const Vec3<V>& axis) {
  return axis.z * bound.sine - sqrt<V>(axis.x * axis.x + axis.y * axis.y) * bound.cosine;
}

// Returns the tool axis in the world.
template <class V>
MMP_INLINE Vec3<V> tool_axis(const Pose<V>& pose) {
  const auto& r = pose.frames[pose.arm->dof].r;
  const auto* a = pose.arm->upright->axis;
  return {r[0] * a[0] + r[1] * a[1] + r[2] * a[2], r[3] * a[0] + r[4] * a[1] + r[5] * a[2],
          r[6] * a[0] + r[7] * a[1] + r[8] * a[2]};
}

template <class V>
MMP_INLINE V upright_room(const Pose<V>& pose) {
  return upright_room<V>(*pose.arm->upright, tool_axis(pose));
}

// Returns an upper bound of the second derivative of the tool axis while joint j turns at rate[j] >= 0. A joint moves
// the axis at most by the sine of the angle between the two, which is constant for the last joint.
template <class V>
inline V axis_curvature(const ArmModel<Scalar<V>>& arm, const V* rate) {
  using T = Scalar<V>;
  const auto* a = arm.upright->axis;
  V before{}, second{};
  for (int j = 0; j < arm.dof; ++j) {
    const V turn = rate[j] * arm.turns[j];
    const T lever = j + 1 < arm.dof ? T(1) : std::min(T(1), std::sqrt(a[0] * a[0] + a[1] * a[1]) + T(1e-6));
    second += (turn * turn + 2 * turn * before) * lever;
    before += turn;
  }
  return second;
}

// Returns a lower bound of the room while the joints sweep. The room is the least signed distance from planes, so it is
// a concave function of the axis, which moves along its tangent but for the second derivative.
template <class V>
inline V upright_room_within(const Pose<V>& pose, const Sweep<V>& sweep) {
  const auto& arm = *pose.arm;
  const auto axis = tool_axis(pose), along = cross(sweep.omega[arm.dof], axis);
  const V ends = min(upright_room<V>(*arm.upright, axis + along), upright_room<V>(*arm.upright, axis - along));
  return ends - axis_curvature<V>(arm, sweep.half_abs) * Scalar<V>(0.5);
}

template <class V>
inline void test_upright(const Pose<V>& pose, const Sweep<V>& sweep, const Levels<Scalar<V>>& levels,
                         Contacts<V>& out) {
  out.touching |= upright_room(pose) < splat<V>(levels.margin + levels.upright);
  out.undecided |= upright_room_within(pose, sweep) < splat<V>(levels.proof + levels.upright);
}

}  // namespace mmp
