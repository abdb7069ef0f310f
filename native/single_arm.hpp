// One arm's planner as others call it: searches that share a static tree, and the proof of what they find.
#pragma once

#include "pair_check.hpp"
#include "si_rrt.hpp"

namespace mmp {

// Of what paths may bulge out of their chords, how much the search allows for: first little, since a proof follows.
template <class T>
inline constexpr T kBulgeShares[] = {T(0.1), T(0.4), T(1)};

// One arm's planner: keeps the static tree between calls, nothing that depends on constraints.
template <class V>
class SingleArm {
 public:
  using T = Scalar<V>;
  SingleArm(StaticWorld<V>& world, int arm, Config<T> start, Config<T> goal, Config<T> max_step, Levels<T> levels,
            T eta, uint64_t seed)
      : task_{&world, arm, std::move(start), std::move(goal), std::move(max_step), levels, eta, {}}, seed_(seed) {}

  // `others` are kept clear of at every instant; `experience`: rows of an earlier path, may be empty; `seen`: where the
  // last search's tree is put, if anywhere.
  LowLevelPath<T> plan(const std::vector<Constraint<V>*>& constraints, const std::vector<const Motion<V>*>& others,
                       const std::vector<T>& experience, const LowLevelOptions& options, uint64_t seed,
                       const Clock& clock, SeenTree<T>* seen = nullptr) {
    if (!reachable(clock)) return {};
    LowLevelPath<T> path;
    int iterations = 0;
    for (const T share : kBulgeShares<T>) {
      EdgeMaker<V> maker(*task_.world, task_.arm, constraints, task_.levels, task_.max_step.data(),
                         Movers<V>(others, task_.levels, share));
      SiRrt<V> search(task_, maker, options, seed);
      path = search.run(experience, clock);
      if (seen) {
        *seen = {};
        search.tree().look(*seen);
      }
      iterations += path.iterations;
      if (!path.found || is_clear(path, others)) break;
      path.found = false;
    }
    path.iterations = iterations;
    return path;
  }

  const CellModel<T>& cell() const { return *task_.world->cell; }
  int arm() const { return task_.arm; }
  int dof() const { return static_cast<int>(task_.start.size()); }

 private:
  bool reachable(const Clock& clock) {
    if (unreachable_ || task_.goal_tree.start >= 0) return !unreachable_;
    EdgeMaker<V> alone(*task_.world, task_.arm, {}, task_.levels, task_.max_step.data());
    const bool found = task_.goal_tree.connect(alone, task_.start, task_.goal, task_.eta, kConnectIterations,
                                               Random(seed_ ^ 0x5bd1e995u), clock);
    unreachable_ = !found && !clock.expired();
    return found;
  }

  bool is_clear(const LowLevelPath<T>& path, const std::vector<const Motion<V>*>& others) {
    if (others.empty()) return true;
    const Motion<V> mine(cell(), task_.arm, path.positions);
    PairCheck<V> check(*task_.world);
    std::vector<double> instants;
    for (const auto* other : others) {
      check(mine, *other, task_.levels, instants);
      if (!instants.empty()) return false;
    }
    return true;
  }

  ArmTask<V> task_;
  uint64_t seed_;
  bool unreachable_ = false;  // no way was found even alone; later calls need not look again
};

}  // namespace mmp
