// All arms on ways that stay as they are: when each goes on, such that none of them ever touches another.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "coordination.hpp"

namespace mmp {

// Depth first, as many arms moving as can. `diagram(a, b)` is the one of arms a < b.
template <class V, class DiagramOf>
class JointTiming {
 public:
  using State = std::vector<int>;  // steps that each arm has done

  // last: the last step of each arm.
  JointTiming(State last, DiagramOf diagram, const Clock& clock)
      : end_(std::move(last)), diagram_(std::move(diagram)), clock_(clock) {}

  // The states from first to last; empty where `most` of them lead nowhere. Adds to `states` how many were looked at.
  std::vector<State> run(int& states, int most) {
    struct Visit {
      State state;
      std::vector<State> branches;
      size_t next = 0;
    };
    std::vector<Visit> stack;
    std::set<State> seen;
    const auto visit = [&](State state) {
      if (!seen.insert(state).second) return;
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
    for (auto& visited : stack) passed.push_back(std::move(visited.state));
    return passed;
  }

 private:
  static constexpr size_t kBranches = 16;   // from one state
  static constexpr int kBranchings = 4096;  // decisions about single arms to find them

  // States that can be next, those in which the first arms have gone on first. `next`: of the arms before the one that
  // is decided.
  void branch(const State& state, State& next, std::vector<State>& out, int& budget) {
    using Pair = Diagram<V>;
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
        fits = diagram_(a, b).may(move, state[a], state[b], clock_);
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
