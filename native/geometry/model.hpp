// Models that the kernels use: arms as chains of hinges and slides with three-level sphere trees, and obstacles.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/convex_hull.hpp"

namespace mmp {

inline constexpr int kMaxDof = 16;
inline constexpr int kMaxLinks = kMaxDof + 2;  // base, one per joint, tool
inline constexpr int kGroupSize = 5;           // spheres in a leaf of the tree

template <class T>
struct Sphere {
  T x, y, z, r;
};

// Rotation (row major) and translation.
template <class T>
struct Transform {
  T r[9], p[3];
};

struct Range {
  int first = 0, count = 0;
};

// Protrusion of spheres [m] that is larger than any cell: no overlap of spheres then tells that hulls overlap.
inline constexpr double kUnknownProtrusion = 1e9;

using Hulls = std::vector<std::shared_ptr<const ConvexHull>>;

// Sphere tree of one link: one bound, then groups, then spheres.
template <class T>
struct Link {
  int frame = 0;      // frame that carries the link; 0 is the base, which does not move
  Sphere<T> bound{};  // encloses all spheres of the link, in that frame
  T center_radius{};  // largest distance of a sphere's centre, or of a point of a hull, from the bound's centre
  Range groups, spheres;
  Range hulls;                           // exact geometry, which the spheres cover; empty: the spheres are the geometry
  T protrusion = T(kUnknownProtrusion);  // largest distance of a point of a sphere from the hulls [m]
};

// Bound on the angle between an axis of the tool and the world's z axis, at most a right angle (geometry/upright.hpp).
template <class T>
struct Upright {
  T axis[3];              // unit vector in the last frame
  T angle, sine, cosine;  // of the bound [rad]
};

template <class T>
struct ArmModel {
  int dof = 0;
  std::vector<Transform<T>> fixed;  // [dof]: frame k + 1 in frame k at q = 0, joint axis z; [0] is in the world
  std::vector<T> turns;             // [dof]: 1 for a hinge, which turns about z, 0 for a slide, which moves along z
  std::vector<T> lower, upper;      // [dof]: limits [rad or m]
  std::vector<Link<T>> links;       // [0] is the base, in world coordinates
  std::vector<Sphere<T>> groups, spheres;
  std::vector<Range> group_spheres;
  Hulls hulls;  // in the frames of their links, those of the base in the world
  std::vector<std::pair<int, int>> self_pairs;
  // lever[link][joint]: upper bound of how far the link's sphere centres and hulls move per unit of the joint, while
  // slides are within their limits. For a hinge it is their distance from the joint's origin [m], for a slide 1.
  std::vector<std::array<T, kMaxDof>> lever;
  Transform<T> tool{};  // tool frame in the last frame
  std::optional<Upright<T>> upright{};

  bool slides(int joint) const { return turns[joint] == T(0); }
};

enum class Shape { box = 0, sphere = 1, cylinder = 2, capsule = 3, hull = 4 };

template <class T>
struct Obstacle {
  Shape shape;
  Transform<T> pose;                       // of the obstacle in the world
  T a, b, c;                               // box: half edges; others: radius, half length
  std::vector<std::array<T, 4>> planes{};  // of a hull: unit normal and offset, the hull is where n.x <= offset
  Hulls exact{};                           // the same body, in the obstacle's frame: one hull or none
  std::vector<uint32_t> allowed{};         // per arm: bit set of the links that may touch it; missing: none

  bool lets_touch(int arm, int link) const {
    return arm < static_cast<int>(allowed.size()) && (allowed[arm] >> link & 1u) != 0;
  }
};

template <class T>
struct CellModel {
  std::vector<ArmModel<T>> arms;
  std::vector<Obstacle<T>> obstacles;
};

template <class T>
Sphere<T> bound_of(const Sphere<T>* s, int n) {
  if (n == 0) return {T(0), T(0), T(0), T(-1e3)};  // negative radius: no distance test passes
  // Starts at the centre of the bounding box and moves towards the farthest sphere (Badoiu and Clarkson).
  double lo[3] = {1e30, 1e30, 1e30}, hi[3] = {-1e30, -1e30, -1e30};
  for (int i = 0; i < n; ++i) {
    const double c[3] = {s[i].x, s[i].y, s[i].z};
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], c[k] - s[i].r);
      hi[k] = std::max(hi[k], c[k] + s[i].r);
    }
  }
  double c[3] = {(lo[0] + hi[0]) / 2, (lo[1] + hi[1]) / 2, (lo[2] + hi[2]) / 2};
  const auto reach = [&](int i) {
    const double dx = s[i].x - c[0], dy = s[i].y - c[1], dz = s[i].z - c[2];
    return std::sqrt(dx * dx + dy * dy + dz * dz) + s[i].r;
  };
  double best = 1e30, best_c[3] = {};
  for (int it = 1; it <= 64; ++it) {
    int far = 0;
    for (int i = 1; i < n; ++i)
      if (reach(i) > reach(far)) far = i;
    if (reach(far) < best) {
      best = reach(far);
      std::copy(c, c + 3, best_c);
    }
    const double step = 1.0 / (it + 1);
    c[0] += (s[far].x - c[0]) * step;
    c[1] += (s[far].y - c[1]) * step;
    c[2] += (s[far].z - c[2]) * step;
  }
  return {T(best_c[0]), T(best_c[1]), T(best_c[2]), T(best * (1 + 1e-6) + 1e-7)};
}

// Splits spheres[range] at the median of the longest axis until a group holds at most kGroupSize.
template <class T>
void split_into_groups(std::vector<Sphere<T>>& spheres, Range range, std::vector<Range>& out) {
  if (range.count <= kGroupSize) {
    out.push_back(range);
    return;
  }
  auto* s = spheres.data() + range.first;
  T Sphere<T>::* axes[3] = {&Sphere<T>::x, &Sphere<T>::y, &Sphere<T>::z};
  int widest = 0;
  T extent = -1;
  for (int k = 0; k < 3; ++k) {
    const auto [lo, hi] =
        std::minmax_element(s, s + range.count, [&](const auto& a, const auto& b) { return a.*axes[k] < b.*axes[k]; });
    if (*hi.*axes[k] - *lo.*axes[k] > extent) {
      extent = *hi.*axes[k] - *lo.*axes[k];
      widest = k;
    }
  }
  std::stable_sort(s, s + range.count, [&](const auto& a, const auto& b) { return a.*axes[widest] < b.*axes[widest]; });
  const int half = range.count / 2;
  split_into_groups(spheres, {range.first, half}, out);
  split_into_groups(spheres, {range.first + half, range.count - half}, out);
}

// Returns the largest distance of the origin of frame joint + 1 from that of frame `joint` [m].
template <class T>
double farthest_origin(const ArmModel<T>& arm, int joint) {
  const auto& t = arm.fixed[joint];
  const auto distance = [&](double travel) {
    return std::hypot(t.p[0] + t.r[2] * travel, t.p[1] + t.r[5] * travel, t.p[2] + t.r[8] * travel);
  };
  return arm.slides(joint) ? std::max(distance(arm.lower[joint]), distance(arm.upper[joint])) : distance(0);
}

// Builds the sphere tree and the levers from `links[].frame`, `links[].spheres` and `spheres`.
template <class T>
void finish_arm(ArmModel<T>& arm) {
  for (auto& link : arm.links) {
    std::vector<Range> groups;
    split_into_groups(arm.spheres, link.spheres, groups);
    link.bound = bound_of(arm.spheres.data() + link.spheres.first, link.spheres.count);
    link.groups = {static_cast<int>(arm.groups.size()), static_cast<int>(groups.size())};
    for (const auto& range : groups) {
      arm.group_spheres.push_back(range);
      arm.groups.push_back(groups.size() == 1 ? link.bound : bound_of(arm.spheres.data() + range.first, range.count));
    }
    double from_bound = 0, from_frame = 0;
    for (int i = 0; i < link.spheres.count; ++i) {
      const auto& s = arm.spheres[link.spheres.first + i];
      from_bound = std::max(
          from_bound, std::hypot(double(s.x - link.bound.x), double(s.y - link.bound.y), double(s.z - link.bound.z)));
      from_frame = std::max(from_frame, std::hypot(double(s.x), double(s.y), double(s.z)));
    }
    for (int h = link.hulls.first; h < link.hulls.first + link.hulls.count; ++h) {
      from_bound = std::max(from_bound, arm.hulls[h]->farthest_from({link.bound.x, link.bound.y, link.bound.z}));
      from_frame = std::max(from_frame, arm.hulls[h]->farthest_from({0, 0, 0}));
    }
    link.center_radius = T(from_bound * (1 + 1e-6));
    std::array<T, kMaxDof> lever{};
    double length = from_frame;
    for (int joint = link.frame - 1; joint >= 0; --joint) {
      lever[joint] = arm.slides(joint) ? T(1) : T(length * (1 + 1e-6));
      length += farthest_origin(arm, joint);
    }
    arm.lever.push_back(lever);
  }
}

}  // namespace mmp
