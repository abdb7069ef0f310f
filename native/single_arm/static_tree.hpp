// Static tree of one arm: a tree to each of its goals, grown once without constraints (RRT-Connect).
#pragma once

#include "single_arm/timed_path.hpp"

namespace mmp {

template <class T>
struct TreeNode {
  Config<T> q;
  int parent;
  int root = 0;  // goal whose tree holds the node
};

// Returns the nearest node that is `wanted`, the first of equally near ones; 0 if none is.
template <class Node, class T, class Wanted>
int nearest(const std::vector<Node>& tree, const Config<T>& q, Wanted&& wanted) {
  int best = 0;
  T least = std::numeric_limits<T>::max();
  for (size_t k = 0; k < tree.size(); ++k) {
    const T d = squared(tree[k].q, q);
    if (d < least && wanted(tree[k])) {
      least = d;
      best = static_cast<int>(k);
    }
  }
  return best;
}
template <class Node, class T>
int nearest(const std::vector<Node>& tree, const Config<T>& q) {
  return nearest(tree, q, [](const Node&) { return true; });
}

// Returns a configuration at most eta from `from` towards the target, inside the bound of an upright tool; empty if
// there is none nearer to the target.
template <class V>
Config<Scalar<V>> towards(EdgeChecker<V>& checker, const Config<Scalar<V>>& from, const Config<Scalar<V>>& target,
                          Scalar<V> eta, Scalar<V> d) {
  using T = Scalar<V>;
  if (d <= eta) return target;
  auto next = between(from, target, eta / d);
  if (!checker.is_upright()) return next;
  const bool nearer = checker.project(next) && distance(next, target) <= d - T(kLeastProgress) * eta;
  return nearer ? next : Config<T>{};
}

// Adds steps of at most eta towards the target while they are free. Returns the last node, or -1 if the first step is
// blocked.
template <class V>
int extend(EdgeChecker<V>& checker, std::vector<TreeNode<Scalar<V>>>& tree, const Config<Scalar<V>>& target, double eta,
           const Clock& clock) {
  using T = Scalar<V>;
  int at = nearest(tree, target), reached = -1;
  for (int it = 1;; ++it) {
    if ((it & 15) == 0 && clock.expired()) return reached;
    const T d = distance(tree[at].q, target);
    if (d <= T(1e-6)) return at;
    Config<T> next = towards(checker, tree[at].q, target, T(eta), d);
    if (next.empty() || !checker.is_static_free(tree[at].q.data(), next.data())) return reached;
    tree.push_back({std::move(next), at, tree[at].root});
    at = reached = static_cast<int>(tree.size()) - 1;
  }
}

// Samples near start and goal first, farther out later: with joint limits of two turns, most of the space is a detour.
template <class T>
Config<T> sample_between(const ArmModel<T>& arm, const Config<T>& start, const Config<T>& goal, int iteration,
                         Random& random) {
  const double u = random.uniform();
  const double slack = u < 0.4 ? 0.8 : u < 0.8 ? 1.8 : 4.0 + 0.002 * iteration;
  Config<T> q(arm.dof);
  for (int j = 0; j < arm.dof; ++j) {
    const double lo = std::max<double>(arm.lower[j], std::min(start[j], goal[j]) - slack);
    const double hi = std::min<double>(arm.upper[j], std::max(start[j], goal[j]) + slack);
    q[j] = T(random.uniform(lo, hi));
  }
  return q;
}

// Draws one of several goals, the first ones more often. A single goal takes no random number.
inline int draw_goal(size_t goals, Random& random) {
  return goals == 1 ? 0 : random.below(random.below(static_cast<int>(goals)) + 1);
}

// Goal tree: every node knows its path to one of the goals. After `connect` it also holds a path from the start.
template <class T>
struct GoalTree {
  std::vector<TreeNode<T>> nodes;
  int start = -1;

  template <class V>
  bool connect(EdgeChecker<V>& checker, const Config<T>& from, const std::vector<Config<T>>& goals, double eta,
               int iterations, Random random, const Clock& clock) {
    std::vector<TreeNode<T>> other_side{{from, -1}};
    if (nodes.empty())
      for (const auto& goal : goals) nodes.push_back({goal, -1, static_cast<int>(nodes.size())});
    for (int it = 0; start < 0 && it < iterations; ++it) {
      if ((it & 15) == 15 && clock.expired()) return false;
      const bool forward = it % 2 == 0;
      auto& grow = forward ? other_side : nodes;
      auto& other = forward ? nodes : other_side;
      Config<T> target =
          it < 2 ? (forward ? goals[0] : from)
                 : sample_between(checker.model(), from, goals[draw_goal(goals.size(), random)], it, random);
      if (it >= 2 && !checker.project(target)) continue;
      const int reached = extend(checker, grow, target, eta, clock);
      if (reached < 0) continue;
      const Config<T> tip = grow[reached].q;
      const int met = extend(checker, other, tip, eta, clock);
      if (met < 0 || distance(other[met].q, tip) > T(1e-6)) continue;
      connect(other_side, forward ? reached : met, forward ? met : reached);
    }
    return start >= 0;
  }

 private:
  // Attaches the branch of the other tree that ends in `node` to `parent`.
  void connect(const std::vector<TreeNode<T>>& other, int node, int parent) {
    if (distance(other[node].q, nodes[parent].q) <= T(1e-6)) node = other[node].parent;
    for (; node >= 0; node = other[node].parent) {
      nodes.push_back({other[node].q, parent, nodes[parent].root});
      parent = static_cast<int>(nodes.size()) - 1;
    }
    start = parent;
  }
};

}  // namespace mmp
