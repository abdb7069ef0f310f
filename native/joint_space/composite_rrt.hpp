// RRT-Connect (Kuffner and LaValle 2000) in the composite space: all joints of all arms, or of some.
//
// The tree of the goals has one root per goal: a path may end at any of them. An edge moves the arms in slots, one
// after the other where they would meet (`composite_steps.hpp`), so an edge that the straight line of all joints does
// not have often exists, and arms that are blocked do not hold up the others. Each path that is found is shortened, and
// proved at every instant. An edge that fails the proof is removed with its descendants, and the trees grow on.
#pragma once

#include "joint_space/composite_proof.hpp"
#include "joint_space/composite_tree.hpp"
#include "runtime/random.hpp"

namespace mmp {

struct CompositeSettings {
  double range = 2.0;  // longest move of an arm on an edge, L2 [rad]
  double step = 0.12;  // between samples of an edge, largest joint [rad]
};

// An edge must come nearer to its target by this share of what is left, or of 1 rad if more is left.
inline constexpr double kLeastGain = 0.2;
inline constexpr double kLeastCut = 0.05;  // least saving of a cut corner, all joints together [rad]

// Two trees that grow towards each other. The search can be continued. Parked arms stand, and the other arms of the
// cell are there with their bases only.
template <class V>
class CompositeSearch {
 public:
  using T = Scalar<V>;
  CompositeSearch(StaticWorld<V>& world, std::vector<int> arms, std::vector<T> start, std::vector<std::vector<T>> goals,
                  Levels<T> looked, Levels<T> proof, const CompositeSettings& settings, uint64_t seed,
                  const std::vector<Parked<T>>& parked = {})
      : steps_(world, arms, parked, looked, T(settings.range), T(settings.step)),
        proof_(world, std::move(arms), parked, proof),
        random_(seed),
        start_(std::move(start)),
        goals_(std::move(goals)),
        forward_(steps_.dof()),
        backward_(steps_.dof()) {
    forward_.add(start_, -1);
    for (const auto& goal : goals_) backward_.add(goal, -1);
  }

  int dof() const { return steps_.dof(); }
  int iterations() const { return iteration_; }
  int nodes() const { return forward_.size() + backward_.size(); }
  int steps() const { return turn_; }

  // Returns the parked arm that was most often in the way, -1 if none was.
  int most_in_the_way() const { return steps_.most_in_the_way(); }
  // Returns the parked arms that touch the others in a state.
  std::vector<int> parked_at(const std::vector<T>& q) { return steps_.parked_at(q.data()); }

  // Returns proved configurations from the start to one of the goals, valid until the next call; empty if `iterations`
  // more do not find a path.
  std::vector<const T*> grow(int iterations, const Clock& clock) {
    if (const auto at = std::ranges::find(goals_, start_); iteration_ == 0 && at != goals_.end()) {
      iteration_ = 1;
      return {forward_.q(0), backward_.q(static_cast<int>(at - goals_.begin()))};
    }
    for (const int end = iteration_ + iterations; iteration_ < end && !clock.expired();) {
      const int it = iteration_++;
      const bool ahead = it % 2 == 0;
      auto &tree = ahead ? forward_ : backward_, &other = ahead ? backward_ : forward_;
      auto target = it < 2 ? (ahead ? goals_[0] : start_) : sample(it);
      if (it >= 2 && !steps_.project(target)) continue;
      const int tip = step(tree, tree.nearest(target), target, clock);
      if (tip < 0) continue;
      const std::vector<T> q(tree.q(tip), tree.q(tip) + dof());
      const int met = connect(other, q, clock);
      if (met < 0) continue;
      if (auto path = joined(ahead ? tip : met, ahead ? met : tip, clock); !path.empty()) return path;
    }
    return {};
  }

 private:
  using Tree = CompositeTree<V>;

  // Samples near the start and one of the goals first, farther out later.
  std::vector<T> sample(int iteration) {
    std::vector<T> q(dof());
    const auto& goal = goals_[goals_.size() == 1 ? 0 : random_.below(static_cast<int>(goals_.size()))];
    for (int a = 0; a < steps_.count(); ++a) {
      const auto& arm = steps_.arm(a);
      const double u = random_.uniform();
      const double slack = u < 0.2 ? 0.8 : u < 0.6 ? 1.8 : 4.0 + 0.002 * iteration;
      for (int j = 0, k = steps_.offset(a); j < arm.dof; ++j, ++k) {
        const double lo = std::max<double>(arm.lower[j], std::min(start_[k], goal[k]) - slack);
        const double hi = std::min<double>(arm.upper[j], std::max(start_[k], goal[k]) + slack);
        q[k] = T(random_.uniform(lo, hi));
      }
    }
    return q;
  }

  // Adds edges until the target is reached. Returns its node, or -1 if the arms get stuck.
  int connect(Tree& tree, const std::vector<T>& target, const Clock& clock) {
    int at = tree.nearest(target);
    while (at >= 0 && !std::equal(target.begin(), target.end(), tree.q(at)))
      at = clock.expired() ? -1 : step(tree, at, target, clock);
    return at;
  }

  // Adds an edge towards the target. Returns its node, or -1 if it hardly comes nearer, or time is up.
  int step(Tree& tree, int from, const std::vector<T>& target, const Clock& clock) {
    return advance(tree.q(from), target, clock) ? tree.add(next_, from, slots_) : -1;
  }
  // Steps from a state towards the target: `next_` by `slots_`. Returns false if it hardly comes nearer, or time is up.
  bool advance(const T* from, const std::vector<T>& target, const Clock& clock) {
    const double before = distance(from, target);
    return before > 0 && steps_(from, target.data(), turn_++ % steps_.count(), next_, slots_, clock) &&
           before - distance(next_.data(), target) >= kLeastGain * std::min(before, 1.0);
  }

  double distance(const T* p, const std::vector<T>& q) const {
    double d2 = 0;
    for (int j = 0; j < dof(); ++j) d2 += double(q[j] - p[j]) * double(q[j] - p[j]);
    return std::sqrt(d2);
  }

  // State of a path, and how the arms get there from the state before: in slots, the last one first unless `ahead`.
  struct State {
    std::vector<T> q;
    Slots slots;
    bool ahead;

    bool operator==(const State&) const = default;
  };
  using Owner = std::pair<Tree*, int>;  // tree and node of an edge

  // Returns the path through both trees, made shorter, if every edge is proved; else removes the failed edges.
  std::vector<const T*> joined(int ahead, int behind, const Clock& clock) {
    std::vector<State> states{{start_, {}, true}};
    std::vector<Owner> owners;
    for (int k = ahead; forward_.parent(k) >= 0; k = forward_.parent(k)) {
      states.push_back({row(forward_, k), forward_.slots(k), true});
      owners.emplace_back(&forward_, k);
    }
    std::reverse(states.begin() + 1, states.end());
    std::reverse(owners.begin(), owners.end());
    for (int k = behind; backward_.parent(k) >= 0; k = backward_.parent(k)) {
      states.push_back({row(backward_, backward_.parent(k)), backward_.slots(k), false});
      owners.emplace_back(&backward_, k);
    }
    const auto straightened = shorter(states, clock), cut = with_cut_corners(straightened, clock);
    if (cut != straightened)
      if (auto path = if_proved(cut, clock); !path.empty()) return path;
    if (straightened != states)
      if (auto path = if_proved(straightened, clock); !path.empty()) return path;
    states_ = std::move(states);
    const auto path = slot_by_slot(states_);
    const auto proved = proof_(path, clock);
    if (!any_fails(proved)) return path;
    for (size_t k = 0; k < proved.size() && !clock.expired(); ++k)
      if (!proved[k]) owners[edge_of_[k]].first->remove_subtree(owners[edge_of_[k]].second);
    return {};
  }
  // Returns the path if every edge is proved, otherwise nothing.
  std::vector<const T*> if_proved(const std::vector<State>& states, const Clock& clock) {
    states_ = states;
    auto path = slot_by_slot(states_);
    if (any_fails(proof_(path, clock))) path.clear();
    return path;
  }
  static bool any_fails(const std::vector<bool>& proved) { return std::ranges::find(proved, false) != proved.end(); }
  std::vector<T> row(const Tree& tree, int k) const { return {tree.q(k), tree.q(k) + dof()}; }

  // Returns the path with steps straight to later states wherever all arms get there.
  std::vector<State> shorter(const std::vector<State>& states, const Clock& clock) {
    std::vector<State> out{states[0]};
    for (size_t at = 0; at + 1 < states.size();) {
      size_t to = states.size() - 1;
      while (to > at + 1 && !reach(out, states[to].q, to - at, clock)) to = at + (to - at) / 2;
      if (to == at + 1) out.push_back(states[to]);
      at = to;
    }
    return out;
  }
  // Appends less than `most` steps from the last state to the target. Returns false, and appends none, if it is not
  // reached.
  bool reach(std::vector<State>& path, const std::vector<T>& target, size_t most, const Clock& clock) {
    const size_t before = path.size();
    while (path.back().q != target) {
      if (path.size() - before + 1 >= most || !advance(path.back().q.data(), target, clock)) {
        path.resize(before);
        return false;
      }
      path.push_back({next_, slots_, true});
    }
    return true;
  }

  // Returns the path with its corners cut: each state moves into the box between its neighbours, or half or a quarter
  // of the way there, if all arms get there, and from there to the state after it.
  std::vector<State> with_cut_corners(std::vector<State> path, const Clock& clock) {
    for (const T share : {T(1), T(1) / 2, T(1) / 4})
      for (size_t k = 1; k + 1 < path.size() && !clock.expired(); ++k) {
        const auto old = path[k].q, after = path[k + 1].q;
        const T* before = path[k - 1].q.data();
        auto q = old;
        for (int j = 0; j < dof(); ++j) {
          const auto [low, high] = std::minmax(before[j], after[j]);
          q[j] += share * (std::clamp(q[j], low, high) - q[j]);
        }
        if (q == old || !steps_.project(q)) continue;
        if (length_by(before, old, after) - length_by(before, q, after) < kLeastCut) continue;
        std::vector<State> cut{path[k - 1]};
        if (!reach(cut, q, 2, clock) || !reach(cut, after, 2, clock)) continue;
        path.erase(path.begin() + k, path.begin() + k + 2);
        path.insert(path.begin() + k, cut.begin() + 1, cut.end());
      }
    return path;
  }
  // Returns the length of a path by one state, all joints together [rad].
  double length_by(const T* before, const std::vector<T>& q, const std::vector<T>& after) const {
    double length = 0;
    for (int j = 0; j < dof(); ++j) length += std::abs(double(q[j]) - before[j]) + std::abs(double(after[j]) - q[j]);
    return length;
  }

  // Returns the states, and those between the slots of each edge. Fills `edge_of_`.
  std::vector<const T*> slot_by_slot(const std::vector<State>& states) {
    std::vector<const T*> path{states[0].q.data()};
    between_.clear();
    edge_of_.clear();
    for (size_t k = 1; k < states.size(); ++k) {
      const auto& [q, slots, ahead] = states[k];
      const int last = *std::ranges::max_element(slots);
      for (int s = 1; s < last; ++s) {
        auto& here = between_.emplace_back(path.back(), path.back() + dof());
        for (int a = 0; a < steps_.count(); ++a)
          if (const int o = steps_.offset(a); slots[a] == (ahead ? s : last + 1 - s))
            std::copy_n(q.begin() + o, steps_.arm(a).dof, here.begin() + o);
        path.push_back(here.data());
      }
      path.push_back(q.data());
      edge_of_.resize(path.size() - 1, static_cast<int>(k) - 1);
    }
    return path;
  }

  CompositeSteps<V> steps_;
  CompositeProof<V> proof_;
  Random random_;
  std::vector<T> start_;
  std::vector<std::vector<T>> goals_;
  Tree forward_, backward_;
  int iteration_ = 0;
  int turn_ = 0;
  std::vector<T> next_;
  Slots slots_;
  std::vector<State> states_;           // of the last path
  std::deque<std::vector<T>> between_;  // states between the slots of its edges
  std::vector<int> edge_of_;            // of each pair of neighbours of the path with them
};

}  // namespace mmp
