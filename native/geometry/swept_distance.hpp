// Distance tests between points, or between the spheres of links, that move straight from one step to the next.
#pragma once

#include "geometry/motion.hpp"
#include "geometry/sphere_pairs.hpp"

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

// Finds the lanes of `asked` in which chords come closer than `far`.
template <class V, class AtA, class AtB>
struct SweptVisitor : SpherePairVisitor {
  static constexpr bool kTestsGroupWithLink = true, kTestsSphereWithGroup = true;
  using M = Motion<V>;
  using T = Scalar<V>;
  const AtA& at_a;
  const AtB& at_b;
  const Chord<V>& bound_b;
  V far;
  unsigned asked, lanes = 0;

  SweptVisitor(const AtA& a, const AtB& b, const Chord<V>& bound, V limit, unsigned wanted)
      : at_a(a), at_b(b), bound_b(bound), far(limit), asked(wanted) {}

  MMP_INLINE const Chord<V>& link_b() const { return bound_b; }
  MMP_INLINE Chord<V> group_a(int g) const { return at_a(&M::groups, g); }
  MMP_INLINE Chord<V> group_b(int g) const { return at_b(&M::groups, g); }
  MMP_INLINE Chord<V> sphere_a(int i) const { return at_a(&M::spheres, i); }
  MMP_INLINE Chord<V> sphere_b(int j) const { return at_b(&M::spheres, j); }
  MMP_INLINE bool near(const Chord<V>& p, T rp, const Chord<V>& q, T rq) const {
    return asked & ~lanes & chords_near(p, q, far + rp + rq);
  }
  MMP_INLINE void pair(const Chord<V>& p, T rp, const Chord<V>& q, T rq) { lanes |= chords_near(p, q, far + rp + rq); }
  MMP_INLINE bool done() const { return !(asked & ~lanes); }
};

// Returns the lanes of `asked` in which spheres of link la of arm a come closer than `far` to spheres of link lb of arm
// b. `at_a` and `at_b` return chords of elements of Motion's arrays.
template <class V, class AtA, class AtB>
inline unsigned links_near(const ArmModel<Scalar<V>>& a, int la, const AtA& at_a, const ArmModel<Scalar<V>>& b, int lb,
                           const AtB& at_b, V far, unsigned asked) {
  using M = Motion<V>;
  const auto link = at_b(&M::links, lb);
  const auto radii = a.links[la].bound.r + b.links[lb].bound.r;
  if (!(asked & chords_near(at_a(&M::links, la), link, far + radii))) return 0;
  SweptVisitor<V, AtA, AtB> visitor(at_a, at_b, link, far, asked);
  visit_sphere_pairs(a, la, b, lb, visitor);
  return asked & visitor.lanes;
}

// Also tells in which lanes spheres come closer by more than they protrude.
template <class V, class AtA, class AtB>
struct ExactSweptVisitor : SweptVisitor<V, AtA, AtB> {
  using T = Scalar<V>;
  T protrusion;
  unsigned sure = 0;

  ExactSweptVisitor(const SweptVisitor<V, AtA, AtB>& limits, T largest)
      : SweptVisitor<V, AtA, AtB>(limits), protrusion(largest) {}

  MMP_INLINE bool near(const Chord<V>& p, T rp, const Chord<V>& q, T rq) const {
    return this->asked & ~sure & chords_near(p, q, this->far + rp + rq);
  }
  MMP_INLINE void pair(const Chord<V>& p, T rp, const Chord<V>& q, T rq) {
    const V limit = this->far + rp + rq;
    const unsigned hit = chords_near(p, q, limit);
    this->lanes |= hit;
    if (hit & ~sure) sure |= chords_near(p, q, max(limit - protrusion, V{}));
  }
  MMP_INLINE bool done() const { return !(this->asked & ~sure); }
};

// Returns the lanes before the first one of `lanes`; all if there is none.
inline unsigned lanes_before_first(unsigned lanes) { return (lanes & -lanes) - 1; }

// Bodies of two motions at the ends of a step.
struct StepEnds {
  PosedHulls a0, a1, b0, b1;
};

// Returns the lanes of `asked` in which the hulls of two links come closer than `far`. `ends(lane)` returns StepEnds.
// With `until_first` it may miss lanes after the first of these. See `links_near` for the others.
template <class V, class AtA, class AtB, class Ends>
inline unsigned hulls_near(const ArmModel<Scalar<V>>& a, int la, const AtA& at_a, const ArmModel<Scalar<V>>& b, int lb,
                           const AtB& at_b, const V& far, unsigned asked, const Ends& ends, bool until_first = false) {
  using M = Motion<V>;
  const auto link = at_b(&M::links, lb);
  const auto radii = a.links[la].bound.r + b.links[lb].bound.r;
  if (!(asked & chords_near(at_a(&M::links, la), link, far + radii))) return 0;
  ExactSweptVisitor<V, AtA, AtB> visitor({at_a, at_b, link, far, asked}, protrusion(a, la, b, lb));
  visit_sphere_pairs(a, la, b, lb, visitor);
  unsigned out = asked & visitor.sure, open = asked & visitor.lanes & ~visitor.sure;
  if (until_first) open &= lanes_before_first(out);
  LastDirection last;
  for (; open; open &= open - 1) {
    const int lane = std::countr_zero(open);
    const StepEnds e = ends(lane);
    if (!swept_hulls_near(e.a0, e.a1, e.b0, e.b1, double(far[lane]), last)) continue;
    out |= 1u << lane;
    if (until_first) break;
  }
  return out;
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
