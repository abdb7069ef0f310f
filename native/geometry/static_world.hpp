// Static bodies around an arm: contacts with them, and the clearance of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/collision.hpp"

namespace mmp {

// Static bodies that one arm can touch: obstacles, the other arms' bases, itself.
//
// Planning uses bases with their cores. A core is the volume that an arm's first link fills at every angle of its first
// joint. It blocks other arms like the base does, and without it only conflicts would reveal that.
template <class V>
struct StaticWorld {
  using T = Scalar<V>;
  static constexpr T kNear = T(0.5);  // [m]

  const CellModel<T>* cell;
  std::vector<Pose<V>> bases;
  std::vector<std::vector<int>> near_bases;  // per arm: the others' bases that its links can be closer to than kNear

  StaticWorld(const CellModel<Scalar<V>>& model, const CellModel<Scalar<V>>& standing) : cell(&model) {
    for (const auto& arm : standing.arms) {
      bases.emplace_back(arm);
      bases.back().ready = 1;
    }
    for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
      near_bases.emplace_back();
      for (int b = 0; b < static_cast<int>(bases.size()); ++b)
        if (b != a && reaches(model.arms[a], bases[b].arm->links[0].bound)) near_bases.back().push_back(b);
    }
  }

  // `reach(l)` and `reach_self(pair index)` return the lane reach of a link and of a self pair. `done(out)` ends the
  // test early.
  template <class Reach, class ReachSelf, class Done>
  void contacts(int a, Pose<V>& pose, const Levels<Scalar<V>>& levels, const Reach& reach, const ReachSelf& reach_self,
                const Done& done, Contacts<V>& out) {
    const auto& arm = cell->arms[a];
    const int links = static_cast<int>(arm.links.size());
    for (int l = 1; l < links; ++l) {
      const V r = reach(l);
      for (const auto& o : cell->obstacles)
        if (!o.lets_touch(a, l)) contact(pose, l, o, levels.margin + levels.obstacles, r + levels.obstacles, out);
      visit_bases(a, max(r, splat<V>(levels.margin)),
                  [&](Pose<V>& base) { contact(pose, l, base, 0, levels.margin, r, out); });
      if (done(out)) return;
    }
    for (size_t k = 0; k < arm.self_pairs.size(); ++k) {
      const auto [i, j] = arm.self_pairs[k];
      contact(pose, i, pose, j, levels.margin + levels.self, reach_self(static_cast<int>(k)) + levels.self, out);
      if (done(out)) return;
    }
  }

  // Lowers `best` to the least clearance minus what `levels` adds for obstacles and self pairs.
  void lower(int a, Pose<V>& pose, const Levels<Scalar<V>>& levels, V& best) {
    const auto& arm = cell->arms[a];
    best += levels.self;
    for (const auto& [i, j] : arm.self_pairs) lower_clearance(pose, i, pose, j, best);
    best += levels.obstacles - levels.self;
    for (int l = static_cast<int>(arm.links.size()) - 1; l >= 1; --l)
      for (const auto& o : cell->obstacles)
        if (!o.lets_touch(a, l)) lower_clearance(pose, l, o, best);
    best -= levels.obstacles;
    for (int l = static_cast<int>(arm.links.size()) - 1; l >= 1; --l)
      visit_bases(a, best, [&](Pose<V>& base) { lower_clearance(pose, l, base, 0, best); });
  }

 private:
  // Returns whether some link of an arm can be closer than kNear to a base. Arms with slides may leave their limits.
  static bool reaches(const ArmModel<T>& arm, const Sphere<T>& base) {
    constexpr T kRounding = T(0.1);  // also covers bounds whose centres are farther out than those of their spheres
    T extent = 0;
    for (size_t l = 1; l < arm.links.size(); ++l)
      extent = std::max(extent, arm.lever[l][0] + 2 * std::max(arm.links[l].bound.r, T(0)));
    const auto* p = arm.fixed[0].p;
    const T dx = base.x - p[0], dy = base.y - p[1], dz = base.z - p[2];
    const bool slides = std::any_of(arm.turns.begin(), arm.turns.end(), [](T turns) { return turns == T(0); });
    return slides || std::sqrt(dx * dx + dy * dy + dz * dz) - base.r < extent + kNear + kRounding;
  }

  // Calls `test` for the bases of other arms that may be closer to a link than `far`.
  template <class Test>
  MMP_INLINE void visit_bases(int a, const V& far, const Test& test) {
    if (!bits<V>(far > splat<V>(kNear))) {
      for (const int b : near_bases[a]) test(bases[b]);
      return;
    }
    for (int b = 0; b < static_cast<int>(bases.size()); ++b)
      if (b != a) test(bases[b]);
  }
};

}  // namespace mmp
