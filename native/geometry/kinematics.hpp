// Forward kinematics of many configurations at once, and bounds on link motion along a joint-space segment.
#pragma once

#include <cstdint>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "geometry/model.hpp"
#include "simd/lanes.hpp"

namespace mmp {

// Allocator that leaves new elements uninitialised: callers write all of them before reading.
template <class T>
struct Unset : std::allocator<T> {
  static_assert(std::is_trivially_destructible_v<T>);
  template <class U>
  struct rebind {
    using other = Unset<U>;
  };
  Unset() = default;
  template <class U>
  Unset(const Unset<U>&) noexcept {}
  template <class U>
  void construct(U*) noexcept {}
  template <class U, class... Args>
  void construct(U* p, Args&&... args) {
    ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
  }
};
template <class T>
using Unfilled = std::vector<T, Unset<T>>;

template <class V>
struct Frame {
  V r[9];
  Vec3<V> p;
};

// One arm's pose in every lane. A link's sphere centres are computed when a query first needs them.
template <class V>
struct Pose {
  const ArmModel<Scalar<V>>* arm = nullptr;
  Frame<V> frames[kMaxDof + 1];
  Vec3<V> link[kMaxLinks];
  Unfilled<Vec3<V>> groups, spheres;
  uint32_t ready = 0;

  explicit Pose(const ArmModel<Scalar<V>>& model)
      : arm(&model), groups(model.groups.size()), spheres(model.spheres.size()) {
    // The base does not move: its spheres are the same in every pose.
    const auto& base = model.links[0];
    for (int g = 0; g < base.groups.count; ++g)
      groups[base.groups.first + g] = fixed(model.groups[base.groups.first + g]);
    for (int s = 0; s < base.spheres.count; ++s)
      spheres[base.spheres.first + s] = fixed(model.spheres[base.spheres.first + s]);
    link[0] = fixed(base.bound);
  }

  void detail(int l) {
    if (ready >> l & 1u) return;
    ready |= 1u << l;
    const auto& part = arm->links[l];
    const auto& f = frames[part.frame];
    for (int g = 0; g < part.groups.count; ++g)
      groups[part.groups.first + g] = apply(f, arm->groups[part.groups.first + g]);
    for (int s = 0; s < part.spheres.count; ++s)
      spheres[part.spheres.first + s] = apply(f, arm->spheres[part.spheres.first + s]);
  }

  static MMP_INLINE Vec3<V> apply(const Frame<V>& f, const Sphere<Scalar<V>>& s) {
    return {f.p.x + f.r[0] * s.x + f.r[1] * s.y + f.r[2] * s.z, f.p.y + f.r[3] * s.x + f.r[4] * s.y + f.r[5] * s.z,
            f.p.z + f.r[6] * s.x + f.r[7] * s.y + f.r[8] * s.z};
  }

 private:
  static Vec3<V> fixed(const Sphere<Scalar<V>>& s) { return {splat<V>(s.x), splat<V>(s.y), splat<V>(s.z)}; }
};

// Computes frames and link bounds at q[0..dof).
template <class V>
inline void forward(const V* q, Pose<V>& pose) {
  using T = Scalar<V>;
  const auto& arm = *pose.arm;
  pose.ready = 1;
  for (int k = 0; k < arm.dof; ++k) {
    const Transform<T>& t = arm.fixed[k];
    Frame<V>& out = pose.frames[k + 1];
    V s, c;
    sincos<V>(q[k], s, c);
    V m[9];
    if (k == 0) {
      for (int i = 0; i < 9; ++i) m[i] = splat<V>(t.r[i]);
      out.p = {splat<V>(t.p[0]), splat<V>(t.p[1]), splat<V>(t.p[2])};
    } else {
      const Frame<V>& in = pose.frames[k];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          m[3 * i + j] = in.r[3 * i] * t.r[j] + in.r[3 * i + 1] * t.r[3 + j] + in.r[3 * i + 2] * t.r[6 + j];
      out.p = {in.p.x + in.r[0] * t.p[0] + in.r[1] * t.p[1] + in.r[2] * t.p[2],
               in.p.y + in.r[3] * t.p[0] + in.r[4] * t.p[1] + in.r[5] * t.p[2],
               in.p.z + in.r[6] * t.p[0] + in.r[7] * t.p[1] + in.r[8] * t.p[2]};
    }
    for (int i = 0; i < 3; ++i) {
      out.r[3 * i] = m[3 * i] * c + m[3 * i + 1] * s;
      out.r[3 * i + 1] = m[3 * i + 1] * c - m[3 * i] * s;
      out.r[3 * i + 2] = m[3 * i + 2];
    }
  }
  for (size_t l = 1; l < arm.links.size(); ++l)
    pose.link[l] = Pose<V>::apply(pose.frames[arm.links[l].frame], arm.links[l].bound);
}

// Bounds on the motion of links while every joint sweeps q_mid - half .. q_mid + half, one segment per lane.
//
// A sphere centre's first derivative is known at the middle. Its second derivative is at most sum_jk |half_j| |half_k|
// rho_max(j,k), because each pair of rotations turns a lever of at most rho about an axis.
template <class V>
struct Sweep {
  Vec3<V> omega[kMaxDof + 1], origin[kMaxDof + 1];
  V half_abs[kMaxDof];

  void set(const Pose<V>& pose, const V* half) {
    const V zero{};
    omega[0] = origin[0] = {zero, zero, zero};
    for (int k = 1; k <= pose.arm->dof; ++k) {
      const auto& f = pose.frames[k];
      const V rate = half[k - 1];
      half_abs[k - 1] = abs(rate);
      origin[k] = k == 1 ? origin[0] : origin[k - 1] + cross(omega[k - 1], f.p - pose.frames[k - 1].p);
      omega[k] = {omega[k - 1].x + f.r[2] * rate, omega[k - 1].y + f.r[5] * rate, omega[k - 1].z + f.r[8] * rate};
    }
  }

  // Returns the largest distance of link l's sphere centres from where they are at the middle.
  V reach(const Pose<V>& pose, int l) const { return reach_relative(pose, 0, l); }

  // Returns the same bound relative to link a of the same arm, which is nearer to the base.
  V reach_relative(const Pose<V>& pose, int a, int b) const {
    const auto& link = pose.arm->links[b];
    const int fa = pose.arm->links[a].frame, fb = link.frame;
    const auto c = pose.link[b];
    auto v = origin[fb] + cross(omega[fb], c - pose.frames[fb].p);
    auto w = omega[fb];
    if (fa > 0) {
      v = v - (origin[fa] + cross(omega[fa], c - pose.frames[fa].p));
      w = w - omega[fa];
    }
    V before{}, second{};
    for (int j = fa; j < fb; ++j) {
      second += (half_abs[j] * half_abs[j] + 2 * half_abs[j] * before) * pose.arm->lever[b][j];
      before += half_abs[j];
    }
    return norm(v) + norm(w) * link.center_radius + second * Scalar<V>(0.5);
  }
};

}  // namespace mmp
