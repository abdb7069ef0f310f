// Distance tests between points, or between the spheres of links, that move straight from one step to the next.
#pragma once

#include "geometry/motion.hpp"

namespace mmp {

// Returns the lanes in which two chords come closer than `limit`; chord_distance2 without its division.
template <class V>
MMP_INLINE unsigned chords_near(const Chord<V>& a, const Chord<V>& b, V limit) {
  const auto d = a.from - b.from, e = a.along - b.along;
  const V limit2 = limit * limit, dd = dot(d, d), de = dot(d, e), ee = dot(e, e);
  const Mask<V> ends = (dd < limit2) | (dd + 2 * de + ee < limit2);
  const Mask<V> between = (de < V{}) & (-de < ee) & (dd * ee - de * de < limit2 * ee);
  return bits<V>(ends | between);
}

// Returns the lanes of `asked` in which spheres of link la of arm a come closer than `far` to spheres of link lb of arm
// b. `at_a` and `at_b` return chords of elements of Motion's arrays.
template <class V, class AtA, class AtB>
inline unsigned links_near(const ArmModel<Scalar<V>>& a, int la, const AtA& at_a, const ArmModel<Scalar<V>>& b, int lb,
                           const AtB& at_b, V far, unsigned asked) {
  using M = Motion<V>;
  const auto &A = a.links[la], &B = b.links[lb];
  const auto link = at_b(&M::links, lb);
  if (!(asked & chords_near(at_a(&M::links, la), link, far + (A.bound.r + B.bound.r)))) return 0;
  unsigned near = 0;
  for (int ga = A.groups.first; ga < A.groups.first + A.groups.count; ++ga) {
    const auto mine = at_a(&M::groups, ga);
    const V wide = far + a.groups[ga].r;
    if (A.groups.count > 1 && !(asked & ~near & chords_near(mine, link, wide + B.bound.r))) continue;
    for (int gb = B.groups.first; gb < B.groups.first + B.groups.count; ++gb) {
      const auto theirs = at_b(&M::groups, gb);
      if (!(asked & ~near & chords_near(mine, theirs, wide + b.groups[gb].r))) continue;
      const Range sa = a.group_spheres[ga], sb = b.group_spheres[gb];
      for (int i = sa.first; i < sa.first + sa.count; ++i) {
        const auto sphere = at_a(&M::spheres, i);
        const V reach = far + a.spheres[i].r;
        if (!(asked & ~near & chords_near(sphere, theirs, reach + b.groups[gb].r))) continue;
        for (int j = sb.first; j < sb.first + sb.count; ++j)
          near |= chords_near(sphere, at_b(&M::spheres, j), reach + b.spheres[j].r);
      }
      if (!(asked & ~near)) return asked;
    }
  }
  return asked & near;
}

// Returns the squared least distance of two points whose difference moves straight from d0 to d1.
template <class V>
MMP_INLINE V chord_distance2(const Vec3<V>& d0, const Vec3<V>& d1) {
  const auto d = d1 - d0;
  const V dd = dot(d, d), zero{};
  const V t = min(max(-dot(d0, d) / max(dd, splat<V>(Scalar<V>(1e-12))), zero), splat<V>(1));
  const auto c = d0 + d * t;
  return dot(c, c);
}

}  // namespace mmp
