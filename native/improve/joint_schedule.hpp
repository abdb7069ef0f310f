// Joint schedule of all arms on fixed paths: when each arm advances so that no two ever touch.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "improve/coordination_diagram.hpp"

namespace mmp {

// Depth-first search that prefers moves of many arms. `diagram(a, b)` is the coordination diagram of arms a < b.
template <class V, class DiagramOf>
class JointScheduler {
 public:
  using State = std::vector<int>;  // steps done by each arm

  // last: the last step of each arm.
  JointScheduler(State last, DiagramOf diagram, const Clock& clock)
      : end_(std::move(last)), diagram_(std::move(diagram)), clock_(clock) {}

  // Returns the states from first to last, or nothing after `most` states. Adds the number of visited states to
  // `states`.
  std::vector<State> run(int& states, int most) {
    struct Visit {
      State state;
      std::vector<State> branches;
      size_t next = 0;
    };
    std::vector<Visit> stack;
    std::set<State> visited;
    const auto visit = [&](State state) {
      if (!visited.insert(state).second) return;
      stack.push_back({std::move(state), {}});
      State next;
      int budget = kBranchings;
      branch(stack.back().state, next, stack.back().branches, budget);
    };
    visit(State(end_.size(), 0));
    while (!stack.empty() && stack.back().state != end_) {
      if (++states > most || clock_.expired()) return {};
      auto& top = stack.back();
      if (top.next == top.branches.size()) stack.pop_back();
      else visit(top.branches[top.next++]);
    }
    std::vector<State> passed;
    for (auto& entry : stack) passed.push_back(std::move(entry.state));
    return passed;
  }

 private:
  static constexpr size_t kBranches = 16;   // successors of one state
  static constexpr int kBranchings = 4096;  // decisions about single arms to find the successors

  // Lists successor states, those in which the first arms advance first. `next` holds the arms decided so far.
  void branch(const State& state, State& next, std::vector<State>& out, int& budget) {
    using Pair = CoordinationDiagram<V>;
    const int b = static_cast<int>(next.size());
    if (out.size() == kBranches || --budget < 0) return;
    if (next.size() == end_.size()) {
      if (next != state) out.push_back(next);
      return;
    }
    for (const bool goes : {true, false}) {
      if (goes && state[b] == end_[b]) continue;
      bool fits = true;
      for (int a = 0; a < b && fits; ++a) {
        const bool other = next[a] > state[a];
        if (!goes && !other) continue;
        const auto move = goes && other ? Pair::both : goes ? Pair::second : Pair::first;
        fits = diagram_(a, b).may_move(move, state[a], state[b], clock_);
      }
      if (!fits) continue;
      next.push_back(state[b] + goes);
      branch(state, next, out, budget);
      next.pop_back();
    }
  }

  State end_;
  DiagramOf diagram_;
  const Clock& clock_;
};

}  // namespace mmp
