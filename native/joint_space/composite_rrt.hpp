// RRT-Connect (Kuffner and LaValle 2000) in the composite space: all joints of all arms, or of some.
//
// The tree of the goals has one root per goal: a path may end at any of them. Edges are sampled every `step` radians. A
// path that is found is then proved at every instant. An edge that fails the proof is removed with its descendants, and
// the trees grow on.
#pragma once

#include "joint_space/composite_edges.hpp"
#include "joint_space/composite_tree.hpp"
#include "runtime/random.hpp"

namespace mmp {

inline constexpr int kManyNodes = 4096;  // with more nodes every iteration looks at the clock

struct CompositeSettings {
  double range = 2.0;  // longest edge, L2 [rad]
  double step = 0.05;  // between samples of an edge, largest joint [rad]
};

// Two trees that grow towards each other. The search can be continued.
template <class V>
class CompositeSearch {
 public:
  using T = Scalar<V>;
  CompositeSearch(StaticWorld<V>& world, std::vector<int> arms, std::vector<T> start, std::vector<std::vector<T>> goals,
                  Levels<T> looked, Levels<T> proof, const CompositeSettings& settings, uint64_t seed)
      : edges_(world, std::move(arms), looked, T(settings.step)),
        proof_(proof),
        range_(T(settings.range)),
        random_(seed),
        start_(std::move(start)),
        goals_(std::move(goals)),
        forward_(edges_.dof()),
        backward_(edges_.dof()) {
    forward_.add(start_, -1);
    for (const auto& goal : goals_) backward_.add(goal, -1);
  }

  int dof() const { return edges_.dof(); }
  int iterations() const { return iteration_; }
  int nodes() const { return forward_.size() + backward_.size(); }

  // Returns proved configurations from the start to one of the goals; empty if `iterations` more do not find a path.
  std::vector<const T*> grow(int iterations, const Clock& clock) {
    if (const auto at = std::ranges::find(goals_, start_); iteration_ == 0 && at != goals_.end()) {
      iteration_ = 1;
      return {forward_.q(0), backward_.q(static_cast<int>(at - goals_.begin()))};
    }
    for (const int end = iteration_ + iterations; iteration_ < end;) {
      if (((iteration_ & 15) == 15 || nodes() > kManyNodes) && clock.expired()) break;
      const int it = iteration_++;
      const bool ahead = it % 2 == 0;
      auto &tree = ahead ? forward_ : backward_, &other = ahead ? backward_ : forward_;
      auto target = it < 2 ? (ahead ? goals_[0] : start_) : sample(it);
      if (it >= 2 && !edges_.project(target)) continue;
      const int tip = extend(tree, target);
      if (tip < 0) continue;
      const std::vector<T> q(tree.q(tip), tree.q(tip) + dof());
      const int met = connect(other, q);
      if (met < 0) continue;
      if (auto path = joined(ahead ? tip : met, ahead ? met : tip, clock); !path.empty()) return path;
    }
    return {};
  }

 private:
  // Samples near the start and one of the goals first, farther out later.
  std::vector<T> sample(int iteration) {
    std::vector<T> q(dof());
    const auto& goal = goals_[goals_.size() == 1 ? 0 : random_.below(static_cast<int>(goals_.size()))];
    for (int a = 0; a < edges_.count(); ++a) {
      const auto& arm = edges_.arm(a);
      const double u = random_.uniform();
      const double slack = u < 0.4 ? 0.8 : u < 0.8 ? 1.8 : 4.0 + 0.002 * iteration;
      for (int j = 0, k = edges_.offset(a); j < arm.dof; ++j, ++k) {
        const double lo = std::max<double>(arm.lower[j], std::min(start_[k], goal[k]) - slack);
        const double hi = std::min<double>(arm.upper[j], std::max(start_[k], goal[k]) + slack);
        q[k] = T(random_.uniform(lo, hi));
      }
    }
    return q;
  }

  // Adds one edge of at most `range` towards the target. Returns its node, or -1.
  int extend(CompositeTree<V>& tree, const std::vector<T>& target) {
    const int near = tree.nearest(target);
    return step(tree, near, target);
  }

  // Adds edges until the target is reached. Returns its node, or -1 if an edge is blocked.
  int connect(CompositeTree<V>& tree, const std::vector<T>& target) {
    int at = tree.nearest(target);
    while (at >= 0 && !std::equal(target.begin(), target.end(), tree.q(at))) at = step(tree, at, target);
    return at;
  }

  int step(CompositeTree<V>& tree, int from, const std::vector<T>& target) {
    const T* p = tree.q(from);
    const double d = distance(p, target);
    if (d == 0) return -1;
    std::vector<T> next = target;
    const auto [upright, most] = edges_.upright_share(p, target.data());
    const T share = d > range_ ? std::min(T(range_ / d), most) : most;
    if (share < T(1)) {
      for (int j = 0; j < dof(); ++j) next[j] = p[j] + share * (target[j] - p[j]);
      if (upright && (!edges_.project(next) || distance(next.data(), target) > d * (1 - kLeastProgress * share)))
        return -1;
    }
    return edges_.free(p, next.data()) ? tree.add(next, from) : -1;
  }

  double distance(const T* p, const std::vector<T>& q) const {
    double d2 = 0;
    for (int j = 0; j < dof(); ++j) d2 += double(q[j] - p[j]) * double(q[j] - p[j]);
    return std::sqrt(d2);
  }

  // Returns the path through both trees if every edge is proved; else removes the failed edges.
  std::vector<const T*> joined(int ahead, int behind, const Clock& clock) {
    std::vector<int> there, back;
    for (int k = ahead; k >= 0; k = forward_.parent(k)) there.push_back(k);
    for (int k = backward_.parent(behind); k >= 0; k = backward_.parent(k)) back.push_back(k);
    std::reverse(there.begin(), there.end());
    std::vector<const T*> path;
    for (const int k : there) path.push_back(forward_.q(k));
    for (const int k : back) path.push_back(backward_.q(k));
    const auto proved = edges_.proved(path, proof_, clock);
    if (std::find(proved.begin(), proved.end(), false) == proved.end()) return path;
    for (size_t k = 0; k < proved.size(); ++k) {
      if (proved[k] || clock.expired()) continue;
      // Edge k leads into there[k + 1], or on the other side out of the node before back[k + 1 - size].
      if (k + 1 < there.size()) forward_.remove_subtree(there[k + 1]);
      else backward_.remove_subtree(k + 1 == there.size() ? behind : back[k - there.size()]);
    }
    return {};
  }

  CompositeEdges<V> edges_;
  Levels<T> proof_;
  T range_;
  Random random_;
  std::vector<T> start_;
  std::vector<std::vector<T>> goals_;
  CompositeTree<V> forward_, backward_;
  int iteration_ = 0;
};

}  // namespace mmp
