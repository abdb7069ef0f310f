// What one arm can do on its own: a tree to its goal, grown once without regard to constraints (RRT-Connect).
#pragma once

#include "way.hpp"

namespace mmp {

template <class T>
struct TreeNode {
  Config<T> q;
  int parent;
};

// The first of the nodes of a tree that are nearest.
template <class Node, class T>
int nearest(const std::vector<Node>& tree, const Config<T>& q) {
  int best = 0;
  T least = std::numeric_limits<T>::max();
  for (size_t k = 0; k < tree.size(); ++k) {
    const T d = squared(tree[k].q, q);
    if (d < least) {
      least = d;
      best = static_cast<int>(k);
    }
  }
  return best;
}

// Steps of at most eta towards the target, as far as it is free; the last node, or -1 if not even one step was.
template <class V>
int extend(EdgeMaker<V>& maker, std::vector<TreeNode<Scalar<V>>>& tree, const Config<Scalar<V>>& target, double eta,
           const Clock& clock) {
  using T = Scalar<V>;
  int at = nearest(tree, target), reached = -1;
  for (int it = 1;; ++it) {
    if ((it & 15) == 0 && clock.expired()) return reached;
    const T d = distance(tree[at].q, target);
    if (d <= T(1e-6)) return at;
    Config<T> next = d <= T(eta) ? target : between(tree[at].q, target, T(eta) / d);
    if (!maker.statically_free(tree[at].q.data(), next.data())) return reached;
    tree.push_back({std::move(next), at});
    at = reached = static_cast<int>(tree.size()) - 1;
  }
}

// Around start and goal first, farther out as it goes on: limits of two turns make most of the space a detour.
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

// The goal's tree: every node knows the way to the goal. Holds the way from the start once `connect` has found one.
template <class T>
struct GoalTree {
  std::vector<TreeNode<T>> nodes;
  int start = -1;

  template <class V>
  bool connect(EdgeMaker<V>& maker, const Config<T>& from, const Config<T>& goal, double eta, int iterations,
               Random random, const Clock& clock) {
    std::vector<TreeNode<T>> other_side{{from, -1}};
    if (nodes.empty()) nodes.push_back({goal, -1});
    for (int it = 0; start < 0 && it < iterations; ++it) {
      if ((it & 15) == 15 && clock.expired()) return false;
      const bool forward = it % 2 == 0;
      auto& grow = forward ? other_side : nodes;
      auto& other = forward ? nodes : other_side;
      const Config<T> target = it < 2 ? (forward ? goal : from) : sample_between(maker.model(), from, goal, it, random);
      const int reached = extend(maker, grow, target, eta, clock);
      if (reached < 0) continue;
      const Config<T> tip = grow[reached].q;
      const int met = extend(maker, other, tip, eta, clock);
      if (met < 0 || distance(other[met].q, tip) > T(1e-6)) continue;
      join(other_side, forward ? reached : met, forward ? met : reached);
    }
    return start >= 0;
  }

 private:
  // Hangs the branch of the other tree that ends in `node` onto `parent`.
  void join(const std::vector<TreeNode<T>>& other, int node, int parent) {
    if (distance(other[node].q, nodes[parent].q) <= T(1e-6)) node = other[node].parent;
    for (; node >= 0; node = other[node].parent) {
      nodes.push_back({other[node].q, parent});
      parent = static_cast<int>(nodes.size()) - 1;
    }
    start = parent;
  }
};

}  // namespace mmp
