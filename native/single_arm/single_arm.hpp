// Public interface of the single-arm planner: searches that share a static tree, and the proof of their results.
#pragma once

#include "proof/pair_check.hpp"
#include "single_arm/si_rrt.hpp"

namespace mmp {

// Shares of the chord deviation that successive searches allow for; a proof follows each search.
template <class T>
inline constexpr T kDeviationShares[] = {T(0.1), T(0.4), T(1)};

// Planner of one arm. Keeps the static tree between calls, and nothing that depends on constraints.
template <class V>
class SingleArm {
 public:
  using T = Scalar<V>;
  // A path may end at any of the goals.
  SingleArm(StaticWorld<V>& world, int arm, Config<T> start, std::vector<Config<T>> goals, Config<T> max_step,
            Levels<T> levels, T eta, uint64_t seed)
      : task_{&world, arm, std::move(start), std::move(max_step), std::move(goals), levels, eta, {}}, seed_(seed) {
    std::ranges::stable_sort(task_.goals, {}, [&](const auto& q) { return length(task_.start, q); });
    task_.eta = std::min(eta, UprightProjection<V>(world.cell->arms[arm]).longest_step());
  }

  // The path is clear of `others` at every instant. `experience`: rows of an earlier path, may be empty. `snapshot`:
  // receives the last search's tree.
  SingleArmPath<T> plan(const std::vector<Constraint<V>*>& constraints, const std::vector<const Motion<V>*>& others,
                        const std::vector<T>& experience, const SingleArmSettings& settings, uint64_t seed,
                        const Clock& clock, TreeSnapshot<T>* snapshot = nullptr) {
    if (!prepare(settings.static_tree, clock)) return {};
    SingleArmPath<T> path;
    int iterations = 0;
    for (const T share : kDeviationShares<T>) {
      EdgeChecker<V> checker(*task_.world, task_.arm, constraints, task_.levels, task_.max_step.data(),
                             DynamicObstacles<V>(others, task_.levels, share));
      SiRrt<V> search(task_, checker, settings, seed);
      path = search.run(experience, clock);
      if (snapshot) {
        *snapshot = {};
        search.tree().copy_to(*snapshot);
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
  // On the first call, removes goals that are not free, and grows the tree from the others if it is used. Returns
  // whether the start reaches one of them, as far as this tells.
  bool prepare(bool static_tree, const Clock& clock) {
    if (unreachable_ || task_.goal_tree.start >= 0) return !unreachable_;
    EdgeChecker<V> alone(*task_.world, task_.arm, {}, task_.levels, task_.max_step.data());
    if (task_.goals.size() > 1)
      std::erase_if(task_.goals, [&](const auto& q) { return !alone.is_static_free(q.data(), q.data()); });
    if (task_.goals.empty()) return !(unreachable_ = true);
    if (!static_tree) return true;
    const bool found = task_.goal_tree.connect(alone, task_.start, task_.goals, task_.eta, kConnectIterations,
                                               Random(seed_ ^ 0x5bd1e995u), clock);
    unreachable_ = !found && !clock.expired();
    return found;
  }

  bool is_clear(const SingleArmPath<T>& path, const std::vector<const Motion<V>*>& others) {
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
  bool unreachable_ =
      false;  // no path exists even without constraints, as far as the search knows; later calls return at once
};

}  // namespace mmp
