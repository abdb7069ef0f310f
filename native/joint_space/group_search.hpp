// RRT-Connect for growing groups of arms.
//
// In a large cell each arm meets few others. First every arm that can goes straight to its goal, in slots. Each arm
// that is left is planned alone, while all others stand. Where that fails, the standing arm that was most often in the
// way joins its group, and the group is planned in its composite space. This is subdimensional expansion (Wagner, Kang,
// Choset 2012), but a group keeps the end of its path, so the next one is planned among arms that have arrived.
#pragma once

#include <deque>
#include <vector>

#include "joint_space/composite_rrt.hpp"
#include "joint_space/layers.hpp"

namespace mmp {

struct GroupSettings {
  CompositeSettings composite{};
  int most = 8;  // arms in a group
};

// Iterations of the first search of a group, for each of its arms, and how they grow after a search that failed.
inline constexpr double kGroupIterations = 40, kGroupGrowth = 2.0;

template <class V>
class GroupSearch {
 public:
  using T = Scalar<V>;
  GroupSearch(StaticWorld<V>& world, std::vector<T> start, std::vector<T> goal, Levels<T> looked, Levels<T> proof,
              const GroupSettings& settings, uint64_t seed)
      : world_(&world),
        goal_(std::move(goal)),
        looked_(looked),
        proof_(proof),
        settings_(settings),
        random_(seed),
        states_{std::move(start)} {
    for (const auto& model : world.cell->arms) {
      offsets_.push_back(dof_);
      dof_ += model.dof;
      groups_.push_back({{arms() - 1}});
    }
  }

  int dof() const { return dof_; }
  int iterations() const { return iterations_; }
  int steps() const { return steps_; }

  // Returns proved configurations from the start to the goal, valid until the next call; empty if `iterations` more do
  // not find a path.
  std::vector<const T*> grow(int iterations, const Clock& clock) {
    if (steps_ == 0) go_straight(clock);
    const int end = iterations_ + iterations;
    int arm = next_arm();
    for (; arm >= 0 && iterations_ < end && !clock.expired(); arm = next_arm()) plan_group(arm, clock);
    if (arm >= 0) return {};
    states_ = Layers<V>(*world_->cell, offsets_, std::max(proof_.margin, proof_.proof))(states_);
    std::vector<const T*> path;
    for (const auto& q : states_) path.push_back(q.data());
    return path;
  }

 private:
  // The arms that are planned together for the sake of one of them.
  struct Group {
    std::vector<int> arms;  // ascending
    double iterations = kGroupIterations;

    double budget() const { return iterations * static_cast<double>(arms.size()); }
  };

  int arms() const { return static_cast<int>(offsets_.size()); }
  int dof_of(int arm) const { return world_->cell->arms[arm].dof; }
  bool has_arrived(int arm) const {
    const T* q = states_.back().data() + offsets_[arm];
    return std::equal(q, q + dof_of(arm), goal_.data() + offsets_[arm]);
  }

  // Returns the arm whose group has the smallest budget, of those that have not arrived; -1 if all have.
  int next_arm() {
    int best = -1;
    for (int k = 0; k < arms(); ++k) {
      const int a = (turn_ + k) % arms();
      if (!has_arrived(a) && (best < 0 || groups_[a].budget() < groups_[best].budget())) best = a;
    }
    turn_ = best + 1;
    return best;
  }

  // Moves every arm that can straight to its goal.
  void go_straight(const Clock& clock) {
    std::vector<int> all(arms());
    for (int a = 0; a < arms(); ++a) all[a] = a;
    CompositeSteps<V> step(*world_, all, {}, looked_, kAnyLength, T(settings_.composite.step));
    std::vector<T> ends;
    Slots slots;
    ++steps_;
    turn_ = random_.below(arms());
    if (!step(states_[0].data(), goal_.data(), turn_, ends, slots, clock)) return;
    std::deque<std::vector<T>> states{states_[0]};
    for (int s = 1; s <= *std::ranges::max_element(slots); ++s) {
      auto& q = states.emplace_back(states.back());
      for (int a = 0; a < arms(); ++a)
        if (slots[a] == s) std::copy_n(ends.begin() + offsets_[a], dof_of(a), q.begin() + offsets_[a]);
    }
    std::vector<const T*> path;
    for (const auto& q : states) path.push_back(q.data());
    const auto proved = CompositeProof<V>(*world_, all, {}, proof_)(path, clock);
    for (size_t k = 0; k < proved.size() && proved[k]; ++k) states_.push_back(states[k + 1]);
  }

  // Plans an arm's group to its goals, or lets another arm join it.
  void plan_group(int arm, const Clock& clock) {
    auto& group = groups_[arm];
    if (static_cast<int>(group.arms.size()) > settings_.most) group.arms = {arm};
    const int budget = std::max(static_cast<int>(std::min(group.budget(), 1e6)), 1);
    for (;;) {
      const auto goal = part(goal_, group.arms);
      const auto parked = others(group.arms);
      CompositeSearch<V> search(*world_, group.arms, part(states_.back(), group.arms), {goal}, looked_, proof_,
                                settings_.composite, random_.next(), parked);
      if (const auto touching = search.parked_at(goal);
          !touching.empty()) {  // they must leave before it can be reached
        for (const int other : touching) join(group.arms, other);
        if (static_cast<int>(group.arms.size()) <= settings_.most) continue;
        ++iterations_;
        group = {{arm}, group.iterations * kGroupGrowth};
        return;
      }
      const auto path = search.grow(budget, clock);
      iterations_ += std::max(search.iterations(), 1);
      steps_ += search.steps();
      if (path.empty()) {
        expand(group, search.most_in_the_way());
      } else {
        follow(path, group.arms);
        group = {{arm}};
      }
      return;
    }
  }

  // Lets an arm join a group, and all groups of the same arms. The next search is longer.
  void expand(Group& group, int joining) {
    Group wider{group.arms, group.iterations * kGroupGrowth};
    if (joining >= 0) join(wider.arms, joining);
    const auto tried = group.arms;
    for (auto& other : groups_)
      if (other.arms == tried) other = wider;
  }
  static void join(std::vector<int>& arms, int arm) { arms.insert(std::ranges::lower_bound(arms, arm), arm); }

  // Appends a path of some arms.
  void follow(const std::vector<const T*>& path, const std::vector<int>& arms) {
    for (size_t k = 1; k < path.size(); ++k) {
      auto& q = states_.emplace_back(states_.back());
      const T* from = path[k];
      for (const int a : arms) {
        std::copy_n(from, dof_of(a), q.begin() + offsets_[a]);
        from += dof_of(a);
      }
    }
  }

  // Returns the joints of some arms.
  std::vector<T> part(const std::vector<T>& q, const std::vector<int>& arms) const {
    std::vector<T> out;
    for (const int a : arms) out.insert(out.end(), q.begin() + offsets_[a], q.begin() + offsets_[a] + dof_of(a));
    return out;
  }
  // Returns all other arms, where they stand.
  std::vector<Parked<T>> others(const std::vector<int>& arms) const {
    std::vector<Parked<T>> out;
    for (int a = 0; a < this->arms(); ++a)
      if (!std::ranges::binary_search(arms, a)) out.push_back({a, part(states_.back(), {a})});
    return out;
  }

  static constexpr T kAnyLength = T(1e6);  // longer than any straight line, L2 [rad]

  StaticWorld<V>* world_;
  std::vector<T> goal_;
  Levels<T> looked_, proof_;
  GroupSettings settings_;
  Random random_;
  std::vector<int> offsets_;
  int dof_ = 0;
  std::deque<std::vector<T>> states_;  // the path so far
  std::vector<Group> groups_;          // of each arm
  int turn_ = 0, iterations_ = 0, steps_ = 0;
};

}  // namespace mmp
