// Exact distance of links: between their convex hulls, one lane at a time.
//
// Spheres cover the hulls. Where spheres are apart, the bodies are apart; only lanes whose spheres come close are
// asked.
#pragma once

#include <algorithm>
#include <bit>

#include "geometry/convex_distance.hpp"
#include "geometry/kinematics.hpp"

namespace mmp {

// Result of a contact test per lane. `touching`: surfaces closer than `margin`. `undecided`: surfaces closer than the
// lane's `reach`, the distance that the caller needs to prove an interval around the lane's instant.
template <class V>
struct Contacts {
  Mask<V> touching{}, undecided{};

  // Returns the contacts of a test that asks for its first `count` lanes. The others count as touching: no test of
  // hulls looks at them.
  static Contacts of_first(int count) {
    Contacts out;
    for (int lane = count; lane < width<V>; ++lane) out.touching[lane] = -1;
    return out;
  }
};

// Returns a bit for each of the first `count` lanes.
template <class V>
inline unsigned first_lanes(int count) {
  return all_bits<V> >> (width<V> - count);
}

// Returns the frame that carries a link, in one lane. Bases and their hulls are in the world.
template <class V>
inline RigidPose lane_pose(const Pose<V>& pose, int link, int lane) {
  RigidPose out;
  const int frame = pose.arm->links[link].frame;
  if (frame == 0) return out;
  const auto& f = pose.frames[frame];
  for (int k = 0; k < 9; ++k) out.r[k] = double(f.r[k][lane]);
  out.p[0] = double(f.p.x[lane]);
  out.p[1] = double(f.p.y[lane]);
  out.p[2] = double(f.p.z[lane]);
  return out;
}

// Hulls of one link, or of an obstacle, and where they are.
struct PosedHulls {
  const std::shared_ptr<const ConvexHull>* first;
  int count;
  RigidPose pose;

  PosedHull operator[](int k) const { return {first[k].get(), pose}; }
};

template <class V>
inline PosedHulls hulls_of(const Pose<V>& pose, int link, int lane) {
  const Range hulls = pose.arm->links[link].hulls;
  return {pose.arm->hulls.data() + hulls.first, hulls.count, lane_pose(pose, link, lane)};
}

template <class T>
inline PosedHulls hulls_of(const Obstacle<T>& o) {
  PosedHulls out{o.exact.data(), static_cast<int>(o.exact.size()), {}};
  for (int k = 0; k < 9; ++k) out.pose.r[k] = double(o.pose.r[k]);
  for (int k = 0; k < 3; ++k) out.pose.p[k] = double(o.pose.p[k]);
  return out;
}

// Returns whether both links have exact geometry.
template <class T>
inline bool exact(const ArmModel<T>& a, int la, const ArmModel<T>& b, int lb) {
  return a.links[la].hulls.count > 0 && b.links[lb].hulls.count > 0;
}

// Returns how much closer the spheres of two links may be than their hulls [m].
template <class T>
inline T protrusion(const ArmModel<T>& a, int la, const ArmModel<T>& b, int lb) {
  return a.links[la].protrusion + b.links[lb].protrusion;
}

// Direction that separated two bodies in the lane before, which in a motion is the step before. It often separates them
// again, and to try it takes less time than to search for one.
class LastDirection {
 public:
  // Returns whether two hulls are at least `limit` apart along the direction. Then the search finds the same.
  bool separates(const PosedHull& a, const PosedHull& b, double limit) const {
    return hull_gap(a, b, direction_) >= limit + kSearchError;
  }
  void remember(const Point& direction) { direction_ = direction; }

 private:
  // More than the search may be wrong by [m], so that results do not depend on the lanes that were tested before.
  static constexpr double kSearchError = 1e-6;
  Point direction_{};
};

// Returns bounds of the distance between two bodies of several hulls.
inline ConvexDistance hulls_distance(const PosedHulls& a, const PosedHulls& b, const Limits& limits,
                                     LastDirection* last = nullptr) {
  ConvexDistance out{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j) {
      const PosedHull one = a[i], other = b[j];
      const Point offset = one.center() - other.center();
      const double bound = std::sqrt(dot(offset, offset)) - (one.hull->bound + other.hull->bound) - kHullRounding;
      if (bound >= std::min(limits.wide, out.lower)) {
        out.lower = std::min(out.lower, bound);
        continue;
      }
      if (last && last->separates(one, other, limits.wide)) {
        out.lower = std::min(out.lower, limits.wide);
        continue;
      }
      const auto found = convex_distance(one, other, limits);
      if (last && found.lower >= limits.wide) last->remember(found.between);
      if (found.upper < out.upper) out.between = found.between;
      out.lower = std::min(out.lower, found.lower);
      out.upper = std::min(out.upper, found.upper);
      if (out.upper < limits.close) return out;
    }
  return out;
}

// Returns whether two bodies whose points move straight from one pose to the next may come closer than `limit`.
inline bool swept_hulls_near(const PosedHulls& a0, const PosedHulls& a1, const PosedHulls& b0, const PosedHulls& b1,
                             double limit, LastDirection& last) {
  for (int i = 0; i < a0.count; ++i)
    for (int j = 0; j < b0.count; ++j) {
      const PosedHull one = a0[i], other = b0[j];
      const Point start = one.center() - other.center(), end = a1[i].center() - b1[j].center(), move = end - start;
      const double far = std::sqrt(dot(start, start)) - std::sqrt(dot(move, move));
      if (far - (one.hull->bound + other.hull->bound) - kHullRounding >= limit) continue;
      if (last.separates(one, other, limit) && last.separates(a1[i], b1[j], limit)) continue;
      const auto found = swept_distance(one, a1[i], other, b1[j], {limit, limit});
      if (found.lower < limit) return true;
      last.remember(found.between);
    }
  return false;
}

// Decides the lanes that spheres leave open. `by_spheres` tells which spheres are closer than the limits, `sure` which
// are closer by more than they protrude. `body_a(lane)` and `body_b(lane)` return hulls. A lane touches when the
// distance is below `margin`, or cannot be told from it; it is undecided below `reach`. Hulls that overlap have no
// depth: below 0 a limit holds for the spheres, and the hulls must overlap as well.
template <class V, class BodyA, class BodyB>
inline void decide_exactly(const Contacts<V>& by_spheres, const Contacts<V>& sure, const BodyA& body_a,
                           const BodyB& body_b, Scalar<V> margin, V reach, Contacts<V>& out) {
  out.touching |= sure.touching;
  out.undecided |= sure.undecided;
  const unsigned touching = bits<V>(by_spheres.touching & ~out.touching);
  const unsigned undecided = bits<V>(by_spheres.undecided & ~out.undecided & ~out.touching);
  LastDirection last;
  for (unsigned open = touching | undecided; open; open &= open - 1) {
    const int lane = std::countr_zero(open);
    const double close = std::max(double(margin), 0.0), wide = std::max(double(reach[lane]), 0.0);
    const bool may_touch = touching >> lane & 1u, may_be_undecided = undecided >> lane & 1u;
    const double one = may_touch ? close : wide, other = may_be_undecided ? wide : close;
    const Limits limits{std::min(one, other), std::max(one, other)};
    const auto d = hulls_distance(body_a(lane), body_b(lane), limits, &last);
    if (may_touch && d.lower < close) out.touching[lane] = -1;
    if (may_be_undecided && d.lower < wide) out.undecided[lane] = -1;
  }
}

// Lowers the lanes of `best` in which spheres are closer: to the distance of the hulls, which is at least that of the
// spheres.
template <class V, class BodyA, class BodyB>
MMP_NOINLINE void lower_exactly(const V& by_spheres, const BodyA& body_a, const BodyB& body_b, V& best) {
  for (unsigned open = bits<V>(by_spheres < best); open; open &= open - 1) {
    const int lane = std::countr_zero(open);
    const auto d = hulls_distance(body_a(lane), body_b(lane), Limits::measure(double(best[lane])));
    const auto exact = std::max(Scalar<V>(d.lower), by_spheres[lane]);
    if (exact < best[lane]) best[lane] = exact;
  }
}

}  // namespace mmp
