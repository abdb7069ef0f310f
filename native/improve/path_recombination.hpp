// Path recombination: chooses one path per arm from a pool of known paths, then times all of them together.
//
// Plans with different passing orders have short paths for different arms. Combinations are tried in order of length
// (A* over the arms). If every pair of a combination is feasible (`coordination_diagram.hpp`), all arms are scheduled
// together.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <queue>
#include <set>
#include <vector>

#include "improve/joint_schedule.hpp"
#include "improve/pooled_path.hpp"
#include "proof/pair_check.hpp"
#include "single_arm/dynamic_obstacles.hpp"

namespace mmp {

template <class V>
class PathRecombination {
 public:
  using T = Scalar<V>;
  using Rows = std::vector<std::vector<T>>;  // per arm, [steps + 1][dof]

  PathRecombination(StaticWorld<V>& world, std::vector<std::vector<T>> max_step, Levels<T> levels)
      : cell_(world.cell), check_(world), levels_(levels), paths_(max_step.size()) {
    for (auto& steps : max_step) limits_.push_back({std::move(steps)});
  }

  const CellModel<T>& cell() const { return *cell_; }
  int arms() const { return static_cast<int>(paths_.size()); }

  // Adds one path per arm, from its start to its goal and free alone. Evicts the longest path when the pool is full.
  // Returns path ids, or -1 for a path that was not added.
  std::vector<int> add(const Rows& rows) {
    std::vector<int> out;
    for (int a = 0; a < arms(); ++a) out.push_back(add(a, rows[a]));
    return out;
  }

  // Returns the id of the shortest path of each arm.
  std::vector<int> shortest() const {
    std::vector<int> out;
    for (const auto& paths : paths_)
      out.push_back(paths.empty() ? -1 : (*std::ranges::min_element(paths, shorter))->id);
    return out;
  }

  // Returns nullptr if the pool does not hold the path.
  const Motion<V>* path(int a, int id) const {
    const int n = index_of(a, id);
    return n < 0 ? nullptr : &paths_[a][n]->motion;
  }

  // Returns whether the pool holds these paths, one per arm.
  bool has(const std::vector<int>& ids) const {
    bool all = static_cast<int>(ids.size()) == arms();
    for (int a = 0; all && a < arms(); ++a) all = index_of(a, ids[a]) >= 0;
    return all;
  }

  // Returns the pairs of arms whose paths have an infeasible coordination diagram; when the clock ends, those found so
  // far.
  std::vector<std::pair<int, int>> infeasible_pairs(std::vector<int> ids, const Clock& clock) {
    for (int a = 0; a < arms(); ++a) ids[a] = index_of(a, ids[a]);
    std::vector<std::pair<int, int>> out;
    for (int b = 0; b < arms(); ++b)
      for (int a = 0; a < b; ++a) {
        if (diagram_states_ > kMaxDiagramStates) forget();
        const bool feasible = diagram(ids, a, b).feasible(0, 0, clock);
        if (clock.expired()) return out;
        if (!feasible) out.emplace_back(a, b);
      }
    return out;
  }

  // Returns motions along a combination of paths with total length below `limit` [rad], or nothing. Never returns a
  // combination twice.
  Rows recombine(double limit, const Clock& clock) {
    const auto orders = shortest_first();
    double least = 0;
    for (const auto& order : orders) {
      if (order.empty()) return {};
      least += order[0].first;
    }
    std::priority_queue<Choice> queue;
    queue.push({least, {}});
    int states = 0;
    for (int expanded = 0; expanded < kMaxExpanded && states < kMaxScheduleStates && !queue.empty() && !clock.expired();
         ++expanded) {
      if (diagram_states_ > kMaxDiagramStates) forget();
      const Choice choice = queue.top();
      queue.pop();
      if (choice.bound >= limit) break;
      if (!last_fits(choice.paths, clock)) continue;
      const size_t a = choice.paths.size();
      if (a == paths_.size()) {
        if (!tried_.insert(ids_of(choice.paths)).second) continue;
        auto rows = timed(choice.paths, states, clock);
        if (!rows.empty()) return rows;
        continue;
      }
      for (const auto& [length, n] : orders[a]) {
        Choice next{choice.bound + length - orders[a][0].first, choice.paths};
        next.paths.push_back(n);
        queue.push(std::move(next));
      }
    }
    return {};
  }

 private:
  // Largest differences of two paths that count as one [rad]. A nearly equal path of the same length adds combinations
  // and no passing order. But the length alone does not tell: all monotone paths between the same ends have one length.
  static constexpr double kSameLength = 1e-6;
  static constexpr double kSameCurve = 0.4;
  static constexpr size_t kMaxPaths = 32;               // per arm
  static constexpr int kMaxSteps = 1000;                // of a path
  static constexpr size_t kMaxDiagramStates = 1 << 26;  // of all stored diagrams, one byte each
  static constexpr int kMaxExpanded = 2000;             // partial and complete combinations expanded
  static constexpr int kMaxScheduleStates = 5000;       // over all combinations of one call
  static constexpr int kMaxScheduleStatesOfOne = 500;   // for one combination

  // Paths of the first arms. `bound`: total length with the shortest paths of the other arms [rad].
  struct Choice {
    double bound;
    std::vector<int> paths;
    // Breaks ties in favour of nearly complete combinations.
    bool operator<(const Choice& o) const {
      if (bound != o.bound) return bound > o.bound;
      return paths.size() != o.paths.size() ? paths.size() < o.paths.size() : paths > o.paths;
    }
  };

  static bool shorter(const std::unique_ptr<PooledPath<V>>& p, const std::unique_ptr<PooledPath<V>>& q) {
    return p->length < q->length;
  }

  int add(int a, const std::vector<T>& rows) {
    auto path = std::make_unique<PooledPath<V>>(*cell_, a, rows, limits_[a], added_++);
    auto& paths = paths_[a];
    const auto same = std::ranges::find_if(paths, [&](const auto& other) {
      return std::abs(other->length - path->length) < kSameLength && largest_difference(*other, *path) < kSameCurve;
    });
    if (same != paths.end()) return (*same)->id;
    if (path->motion.last > kMaxSteps) return -1;
    const int id = path->id;
    if (paths.size() < kMaxPaths) {
      paths.push_back(std::move(path));
      return id;
    }
    const auto longest = std::ranges::max_element(paths, shorter);
    if ((*longest)->length <= path->length) return -1;
    forget((*longest)->id);
    *longest = std::move(path);
    return id;
  }

  int index_of(int a, int id) const {
    const auto it = std::ranges::find_if(paths_[a], [&](const auto& path) { return path->id == id; });
    return it == paths_[a].end() ? -1 : static_cast<int>(it - paths_[a].begin());
  }

  std::vector<std::vector<std::pair<double, int>>> shortest_first() const {
    std::vector<std::vector<std::pair<double, int>>> out(paths_.size());
    for (size_t a = 0; a < paths_.size(); ++a) {
      for (size_t n = 0; n < paths_[a].size(); ++n) out[a].emplace_back(paths_[a][n]->length, static_cast<int>(n));
      std::sort(out[a].begin(), out[a].end());
    }
    return out;
  }

  const Motion<V>& motion(const std::vector<int>& choice, int a) const { return paths_[a][choice[a]]->motion; }

  std::vector<int> ids_of(const std::vector<int>& choice) const {
    std::vector<int> out;
    for (int a = 0; a < arms(); ++a) out.push_back(paths_[a][choice[a]]->id);
    return out;
  }

  CoordinationDiagram<V>& diagram(const std::vector<int>& choice, int a, int b) {
    const std::pair key{paths_[a][choice[a]]->id, paths_[b][choice[b]]->id};
    const auto [at, made] =
        diagrams_.try_emplace(key, motion(choice, a), motion(choice, b), levels_, kPartialDeviation<T>);
    if (made) diagram_states_ += at->second.states();
    return at->second;
  }

  // Drops all diagrams, or those of one path.
  void forget(int id = -1) {
    std::erase_if(diagrams_, [&](const auto& entry) {
      const auto& [pair, diagram] = entry;
      const bool goes = id < 0 || pair.first == id || pair.second == id;
      if (goes) diagram_states_ -= diagram.states();
      return goes;
    });
  }

  bool last_fits(const std::vector<int>& choice, const Clock& clock) {
    const int b = static_cast<int>(choice.size()) - 1;
    for (int a = 0; a < b; ++a)
      if (!diagram(choice, a, b).feasible(0, 0, clock)) return false;
    return true;
  }

  // Times a combination. Adds the number of visited states to `states`.
  Rows timed(const std::vector<int>& choice, int& states, const Clock& clock) {
    std::vector<int> last;
    for (int a = 0; a < arms(); ++a) last.push_back(motion(choice, a).last);
    const auto of_pair = [&](int a, int b) -> CoordinationDiagram<V>& { return diagram(choice, a, b); };
    JointScheduler<V, decltype(of_pair)> scheduler(std::move(last), of_pair, clock);
    const auto passed = scheduler.run(states, std::min(kMaxScheduleStates, states + kMaxScheduleStatesOfOne));
    Rows rows(arms());
    for (const auto& state : passed)
      for (int a = 0; a < arms(); ++a) {
        const T* q = motion(choice, a).at(state[a]);
        rows[a].insert(rows[a].end(), q, q + limits_[a].dof());
      }
    return !passed.empty() && clear(rows) ? rows : Rows{};
  }

  bool clear(const Rows& rows) {
    std::vector<Motion<V>> motions;
    std::vector<double> instants;
    for (int a = 0; a < arms(); ++a) {
      motions.emplace_back(*cell_, a, rows[a]);
      for (int b = 0; b < a; ++b) {
        check_(motions[b], motions[a], levels_, instants);
        if (!instants.empty()) return false;
      }
    }
    return true;
  }

  const CellModel<T>* cell_;
  PairCheck<V> check_;
  Levels<T> levels_;
  std::vector<StepLimits<T>> limits_;
  std::vector<std::vector<std::unique_ptr<PooledPath<V>>>> paths_;  // of each arm
  int added_ = 0;                                                   // paths added so far
  std::map<std::pair<int, int>, CoordinationDiagram<V>> diagrams_;  // by path ids
  size_t diagram_states_ = 0;                                       // of all stored diagrams
  std::set<std::vector<int>> tried_;                                // combinations tried, as path ids
};

}  // namespace mmp
