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
    if (arm.slides(k)) {
      std::copy_n(m, 9, out.r);
      out.p = out.p + Vec3<V>{m[2], m[5], m[8]} * q[k];
      continue;
    }
    V s, c;
    sincos<V>(q[k], s, c);
    for (int i = 0; i < 3; ++i) {
      out.r[3 * i] = m[3 * i] * c + m[3 * i + 1] * s;
      out.r[3 * i + 1] = m[3 * i + 1] * c - m[3 * i] * s;
      out.r[3 * i + 2] = m[3 * i + 2];
    }
  }
  for (size_t l = 1; l < arm.links.size(); ++l)
    pose.link[l] = Pose<V>::apply(pose.frames[arm.links[l].frame], arm.links[l].bound);
}

// Returns how far a slide leaves its limits between two positions [m].
template <class V>
inline V beyond_limits(const ArmModel<Scalar<V>>& arm, int joint, V from, V to) {
  return max(max(arm.lower[joint] - min(from, to), max(from, to) - arm.upper[joint]), V{});
}

// Returns an upper bound of the second derivative of the link's sphere centres and of points of its hulls in frame
// `first`, while joint j moves at rate[j] >= 0 and slides are at most `beyond` out of their limits altogether [m].
//
// A hinge i turns the motion by joint j about its axis: at most 2 rate_i rate_j lever_j if j is farther out, and
// rate_j^2 lever_j if i = j. A slide turns nothing.
template <class V>
inline V curvature(const ArmModel<Scalar<V>>& arm, int link, int first, const V* rate, V beyond) {
  V before{}, second{};
  for (int j = first; j < arm.links[link].frame; ++j) {
    const V turn = rate[j] * arm.turns[j];
    second += (rate[j] * turn + 2 * rate[j] * before) * (arm.lever[link][j] + beyond);
    before += turn;
  }
  return second;
}

// Bounds on the motion of links while every joint sweeps middle - half .. middle + half, one segment per lane: by the
// first derivative at the middle and the largest second one.
template <class V>
struct Sweep {
  Vec3<V> omega[kMaxDof + 1], origin[kMaxDof + 1];
  V half_abs[kMaxDof], beyond;

  // `pose` is that of `middle`.
  void set(const Pose<V>& pose, const V* middle, const V* half) {
    const auto& arm = *pose.arm;
    const V zero{};
    beyond = zero;
    omega[0] = origin[0] = {zero, zero, zero};
    for (int k = 1; k <= arm.dof; ++k) {
      const auto& f = pose.frames[k];
      const V rate = half[k - 1];
      half_abs[k - 1] = abs(rate);
      origin[k] = k == 1 ? origin[0] : origin[k - 1] + cross(omega[k - 1], f.p - pose.frames[k - 1].p);
      if (arm.slides(k - 1)) {
        origin[k] = origin[k] + Vec3<V>{f.r[2], f.r[5], f.r[8]} * rate;
        omega[k] = omega[k - 1];
        beyond += beyond_limits<V>(arm, k - 1, middle[k - 1] - rate, middle[k - 1] + rate);
        continue;
      }
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
    const V second = curvature<V>(*pose.arm, b, fa, half_abs, beyond);
    return norm(v) + norm(w) * link.center_radius + second * Scalar<V>(0.5);
  }
};

}  // namespace mmp
