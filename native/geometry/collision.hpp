// Distances and contacts between sphere trees, and between sphere trees and obstacles.
#pragma once

#include "geometry/kinematics.hpp"
#include "geometry/link_distance.hpp"
#include "geometry/sphere_pairs.hpp"

namespace mmp {

template <class V>
MMP_INLINE Mask<V> closer(const Vec3<V>& a, const Vec3<V>& b, V limit) {
  const auto d = a - b;
  return (dot(d, d) < limit * limit) & (limit > V{});
}

// Distances between surfaces [m]: closer than `margin` is a contact; a proof covers `proof` at every instant. Both hold
// between two arms. `obstacles`, `self` and `upright` are added for an arm and an obstacle, for two parts of one arm,
// and for the room of an upright tool.
template <class T>
struct Levels {
  T margin, proof;
  T obstacles{}, self{}, upright{};
};

// Centres of two poses' groups and spheres, one lane per configuration.
template <class V>
struct PoseVisitor : SpherePairVisitor {
  static constexpr bool kTestsGroupWithLink = true;
  const Vec3<V>*groups_a, *groups_b, *spheres_a, *spheres_b, *bound_b;

  PoseVisitor(const Pose<V>& a, const Pose<V>& b, int lb)
      : groups_a(a.groups.data()),
        groups_b(b.groups.data()),
        spheres_a(a.spheres.data()),
        spheres_b(b.spheres.data()),
        bound_b(&b.link[lb]) {}

  MMP_INLINE const Vec3<V>& link_b() const { return *bound_b; }
  MMP_INLINE const Vec3<V>& group_a(int g) const { return groups_a[g]; }
  MMP_INLINE const Vec3<V>& group_b(int g) const { return groups_b[g]; }
  MMP_INLINE const Vec3<V>& sphere_a(int i) const { return spheres_a[i]; }
  MMP_INLINE const Vec3<V>& sphere_b(int j) const { return spheres_b[j]; }
};

// Finds contacts at `margin` and within `reach`; `far` is the larger one.
template <class V>
struct ContactVisitor : PoseVisitor<V> {
  using T = Scalar<V>;
  T margin;
  V reach, far;
  Contacts<V>& out;

  ContactVisitor(const Pose<V>& a, const Pose<V>& b, int lb, T at_margin, V at_reach, V farther, Contacts<V>& result)
      : PoseVisitor<V>(a, b, lb), margin(at_margin), reach(at_reach), far(farther), out(result) {}

  MMP_INLINE bool near(const Vec3<V>& p, T rp, const Vec3<V>& q, T rq) const {
    return bits<V>(closer(p, q, far + (rp + rq)));
  }
  MMP_INLINE void pair(const Vec3<V>& p, T rp, const Vec3<V>& q, T rq) {
    const auto d = p - q;
    const V d2 = dot(d, d);
    const T radii = rp + rq, close = margin + radii;
    const V wide = reach + radii;
    out.touching |= (d2 < splat<V>(close * close)) & (splat<V>(close) > V{});
    out.undecided |= (d2 < wide * wide) & (wide > V{});
  }
};

// Also tells which spheres are closer than the limits by more than they protrude.
template <class V>
struct ExactContactVisitor : ContactVisitor<V> {
  using T = Scalar<V>;
  T deep;
  V deep_reach;
  Contacts<V>& sure;

  ExactContactVisitor(const ContactVisitor<V>& limits, T protrusion, Contacts<V>& result)
      : ContactVisitor<V>(limits),
        deep(limits.margin - protrusion),
        deep_reach(limits.reach - protrusion),
        sure(result) {}

  MMP_INLINE void pair(const Vec3<V>& p, T rp, const Vec3<V>& q, T rq) {
    ContactVisitor<V>::pair(p, rp, q, rq);
    const auto d = p - q;
    const V d2 = dot(d, d), wide = deep_reach + (rp + rq);
    const T close = deep + (rp + rq);
    sure.touching |= (d2 < splat<V>(close * close)) & (splat<V>(close) > V{});
    sure.undecided |= (d2 < wide * wide) & (wide > V{});
  }
};

// Tests links with hulls, whose bounds are near and whose spheres are known.
template <class V>
MMP_NOINLINE void contact_exactly(const Pose<V>& a, int la, const Pose<V>& b, int lb, Scalar<V> margin, const V& reach,
                                  const V& far, Contacts<V>& out) {
  Contacts<V> near, sure;
  visit_sphere_pairs(
      *a.arm, la, *b.arm, lb,
      ExactContactVisitor<V>({a, b, lb, margin, reach, far, near}, protrusion(*a.arm, la, *b.arm, lb), sure));
  decide_exactly<V>(
      near, sure, [&](int lane) { return hulls_of(a, la, lane); }, [&](int lane) { return hulls_of(b, lb, lane); },
      margin, reach, out);
}

// Tests link la of pose a against link lb of pose b.
template <class V>
inline void contact(Pose<V>& a, int la, Pose<V>& b, int lb, Scalar<V> margin, V reach, Contacts<V>& out) {
  const V far = max(reach, splat<V>(margin));
  const auto radii = a.arm->links[la].bound.r + b.arm->links[lb].bound.r;
  if (!bits<V>(closer(a.link[la], b.link[lb], far + radii))) return;
  a.detail(la);
  b.detail(lb);
  if (exact(*a.arm, la, *b.arm, lb)) contact_exactly<V>(a, la, b, lb, margin, reach, far, out);
  else visit_sphere_pairs(*a.arm, la, *b.arm, lb, ContactVisitor<V>(a, b, lb, margin, reach, far, out));
}

// Lowers `best` to the least distance of two spheres' surfaces.
template <class V>
struct ClearanceVisitor : PoseVisitor<V> {
  static constexpr bool kTestsSphereWithGroup = true;
  using T = Scalar<V>;
  V& best;

  ClearanceVisitor(const Pose<V>& a, const Pose<V>& b, int lb, V& result) : PoseVisitor<V>(a, b, lb), best(result) {}

  MMP_INLINE bool near(const Vec3<V>& p, T rp, const Vec3<V>& q, T rq) const {
    return bits<V>(closer(p, q, best + (rp + rq)));
  }
  MMP_INLINE void pair(const Vec3<V>& p, T rp, const Vec3<V>& q, T rq) {
    const auto d = p - q;
    const T radii = rp + rq;
    const V d2 = dot(d, d), limit = best + radii;
    if (bits<V>((d2 < limit * limit) & (limit > V{}))) best = min(best, sqrt<V>(d2) - radii);
  }
};

// Lowers `best` to the clearance between two links with hulls.
template <class V>
MMP_NOINLINE void lower_clearance_exactly(const Pose<V>& a, int la, const Pose<V>& b, int lb, V& best) {
  V by_spheres = best;
  visit_sphere_pairs(*a.arm, la, *b.arm, lb, ClearanceVisitor<V>(a, b, lb, by_spheres));
  lower_exactly<V>(
      by_spheres, [&](int lane) { return hulls_of(a, la, lane); }, [&](int lane) { return hulls_of(b, lb, lane); },
      best);
}

// Lowers `best` to the clearance between two links where that is smaller.
template <class V>
inline void lower_clearance(Pose<V>& a, int la, Pose<V>& b, int lb, V& best) {
  const auto radii = a.arm->links[la].bound.r + b.arm->links[lb].bound.r;
  if (!bits<V>(closer(a.link[la], b.link[lb], best + radii))) return;
  a.detail(la);
  b.detail(lb);
  if (exact(*a.arm, la, *b.arm, lb)) lower_clearance_exactly<V>(a, la, b, lb, best);
  else visit_sphere_pairs(*a.arm, la, *b.arm, lb, ClearanceVisitor<V>(a, b, lb, best));
}

// Returns the signed distance from points to the surface of an obstacle, negative inside; outside a hull, a lower
// bound.
template <class V>
inline V distance(const Obstacle<Scalar<V>>& o, const Vec3<V>& point) {
  const auto& t = o.pose;
  const V x = point.x - t.p[0], y = point.y - t.p[1], z = point.z - t.p[2];
  const Vec3<V> p{x * t.r[0] + y * t.r[3] + z * t.r[6], x * t.r[1] + y * t.r[4] + z * t.r[7],
                  x * t.r[2] + y * t.r[5] + z * t.r[8]};
  const V zero{};
  switch (o.shape) {
    case Shape::box: {
      const Vec3<V> q{abs(p.x) - o.a, abs(p.y) - o.b, abs(p.z) - o.c};
      const V inside = min(max(q.x, max(q.y, q.z)), zero);
      return norm(Vec3<V>{max(q.x, zero), max(q.y, zero), max(q.z, zero)}) + inside;
    }
    case Shape::sphere:
      return norm(p) - o.a;
    case Shape::cylinder: {
      const V dr = sqrt<V>(p.x * p.x + p.y * p.y) - o.a, dz = abs(p.z) - o.b;
      const V outer_r = max(dr, zero), outer_z = max(dz, zero);
      return sqrt<V>(outer_r * outer_r + outer_z * outer_z) + min(max(dr, dz), zero);
    }
    case Shape::capsule:
      return norm(Vec3<V>{p.x, p.y, p.z - max(min(p.z, splat<V>(o.b)), splat<V>(-o.b))}) - o.a;
    case Shape::hull: {
      V farthest = splat<V>(Scalar<V>(-1e3));
      for (const auto& plane : o.planes)
        farthest = max(farthest, p.x * plane[0] + p.y * plane[1] + p.z * plane[2] - plane[3]);
      return farthest;
    }
  }
  return zero;
}

// Calls `test` with the distance between an obstacle and each sphere of a link whose group is closer than `far`.
template <class V, class Test>
MMP_INLINE void visit_distances(const Pose<V>& a, int la, const Obstacle<Scalar<V>>& o, const V& far,
                                const Test& test) {
  const auto& arm = *a.arm;
  const auto& link = arm.links[la];
  for (int g = link.groups.first; g < link.groups.first + link.groups.count; ++g) {
    if (link.groups.count > 1 && !bits<V>(distance<V>(o, a.groups[g]) < far + arm.groups[g].r)) continue;
    const Range s = arm.group_spheres[g];
    for (int i = s.first; i < s.first + s.count; ++i) test(distance<V>(o, a.spheres[i]) - arm.spheres[i].r);
  }
}

// Tests a link with hulls against an obstacle that has one.
template <class V>
MMP_NOINLINE void contact_exactly(const Pose<V>& a, int la, const Obstacle<Scalar<V>>& o, Scalar<V> margin,
                                  const V& reach, const V& far, Contacts<V>& out) {
  const auto protrusion = a.arm->links[la].protrusion;
  const bool bounds_above = o.shape != Shape::hull;  // beside an edge of a hull, `distance` is only a lower bound
  Contacts<V> near, sure;
  visit_distances(a, la, o, far, [&](const V& d) {
    near.touching |= d < splat<V>(margin);
    near.undecided |= d < reach;
    if (!bounds_above) return;
    sure.touching |= d < splat<V>(margin - protrusion);
    sure.undecided |= d < reach - protrusion;
  });
  decide_exactly<V>(
      near, sure, [&](int lane) { return hulls_of(a, la, lane); }, [&](int) { return hulls_of(o); }, margin, reach,
      out);
}

template <class V>
inline void contact(Pose<V>& a, int la, const Obstacle<Scalar<V>>& o, Scalar<V> margin, V reach, Contacts<V>& out) {
  const auto& link = a.arm->links[la];
  const V far = max(reach, splat<V>(margin));
  if (!bits<V>(distance<V>(o, a.link[la]) < far + link.bound.r)) return;
  a.detail(la);
  if (link.hulls.count > 0 && !o.exact.empty()) {
    contact_exactly<V>(a, la, o, margin, reach, far, out);
    return;
  }
  visit_distances(a, la, o, far, [&](const V& d) {
    out.touching |= d < splat<V>(margin);
    out.undecided |= d < reach;
  });
}

template <class V>
inline void lower_clearance(Pose<V>& a, int la, const Obstacle<Scalar<V>>& o, V& best) {
  const auto& arm = *a.arm;
  const auto& link = arm.links[la];
  if (!bits<V>(distance<V>(o, a.link[la]) < best + link.bound.r)) return;
  a.detail(la);
  V by_spheres = best;
  for (int i = link.spheres.first; i < link.spheres.first + link.spheres.count; ++i)
    by_spheres = min(by_spheres, distance<V>(o, a.spheres[i]) - arm.spheres[i].r);
  if (link.hulls.count > 0 && !o.exact.empty())
    lower_exactly<V>(
        by_spheres, [&](int lane) { return hulls_of(a, la, lane); }, [&](int) { return hulls_of(o); }, best);
  else best = by_spheres;
}

// Lowers `best` to the clearance between the moving links of two arms; with `bases`, also between moving links and
// bases.
template <class V>
inline void lower_pair_clearance(Pose<V>& a, Pose<V>& b, bool bases, V& best) {
  const int na = static_cast<int>(a.arm->links.size()), nb = static_cast<int>(b.arm->links.size());
  for (int i = na - 1; i >= (bases ? 0 : 1); --i)
    for (int j = nb - 1; j >= (bases ? 0 : 1); --j)
      if (i > 0 || j > 0) lower_clearance(a, i, b, j, best);
}

}  // namespace mmp
