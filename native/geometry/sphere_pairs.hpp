// Traversal of the sphere trees of two links: groups against groups, and spheres of the groups that may be near.
#pragma once

#include "geometry/model.hpp"
#include "simd/lanes.hpp"

namespace mmp {

// Defaults of a visitor. A node is what a visitor needs to know about a bound, a group or a sphere, such as its centre.
// A visitor defines
//   group_a(g), group_b(g), sphere_a(i), sphere_b(j)   nodes
//   near(a, radius_a, b, radius_b)                      whether to descend
//   pair(a, radius_a, b, radius_b)                      called with each pair of spheres
struct SpherePairVisitor {
  static constexpr bool kTestsGroupWithLink = false;    // a group of the first link with link_b(), the second's bound
  static constexpr bool kTestsSphereWithGroup = false;  // a sphere of the first link with a group of the second
  void begin_sphere() {}                                // before the pairs of one sphere with one group
  template <class Node>
  void end_sphere(const Node&) {}
  bool done() const { return false; }  // whether to stop, asked after each pair of groups
};

// Visits the pairs of spheres of link la of arm a and link lb of arm b whose groups are near. Callers test the links'
// bounds.
template <class T, class Visitor>
MMP_INLINE void visit_sphere_pairs(const ArmModel<T>& a, int la, const ArmModel<T>& b, int lb, Visitor&& visitor) {
  using Traits = std::remove_reference_t<Visitor>;
  const auto &A = a.links[la], &B = b.links[lb];
  for (int ga = A.groups.first; ga < A.groups.first + A.groups.count; ++ga) {
    const auto& group_a = visitor.group_a(ga);
    const T ra = a.groups[ga].r;
    if constexpr (Traits::kTestsGroupWithLink)
      if (A.groups.count > 1 && !visitor.near(group_a, ra, visitor.link_b(), B.bound.r)) continue;
    for (int gb = B.groups.first; gb < B.groups.first + B.groups.count; ++gb) {
      const auto& group_b = visitor.group_b(gb);
      const T rb = b.groups[gb].r;
      if (!visitor.near(group_a, ra, group_b, rb)) continue;
      const Range sa = a.group_spheres[ga], sb = b.group_spheres[gb];
      for (int i = sa.first; i < sa.first + sa.count; ++i) {
        const auto& sphere_a = visitor.sphere_a(i);
        const T r = a.spheres[i].r;
        if constexpr (Traits::kTestsSphereWithGroup)
          if (!visitor.near(sphere_a, r, group_b, rb)) continue;
        visitor.begin_sphere();
        for (int j = sb.first; j < sb.first + sb.count; ++j)
          visitor.pair(sphere_a, r, visitor.sphere_b(j), b.spheres[j].r);
        visitor.end_sphere(sphere_a);
      }
      if (visitor.done()) return;
    }
  }
}

}  // namespace mmp
