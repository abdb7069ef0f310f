// RRT in space and time for a path of one arm that is shorter than a limit.
//
// After Informed RRT* (Gammell, Srinivasa, Barfoot 2014), in L1: a configuration in the box between start and goal lies
// on a path as short as the straight line; a configuration outside costs twice its distance from the box. The tree
// keeps only configurations from which the goal can be reached within the limit. It reaches each safe interval as early
// as possible.
#pragma once

#include "single_arm/static_tree.hpp"
#include "single_arm/via_point.hpp"

namespace mmp {

template <class V>
class InformedRrt {
 public:
  using T = Scalar<V>;
  InformedRrt(EdgeChecker<V>& checker, const Config<T>& start, const Config<T>& goal, T eta, Random& random)
      : checker_(checker),
        start_(make_waypoint(checker, start)),
        goal_(make_waypoint(checker, goal)),
        eta_(std::min(eta, checker.longest_step())),
        random_(random),
        best_(checker) {}

  // Grows the tree by `iterations`, or by `more` after the first path. The result is in `best`.
  void grow(double limit, int iterations, int more, const Clock& clock) {
    if (start_.safe.empty() || start_.safe[0].first > 0 || goal_.safe.empty() || goal_.safe.back().second < kForever)
      return;
    limit_ = limit;
    straight_ = length(start_.q, goal_.q);
    nodes_.push_back({start_, -1, 0, {{0, leave_start_by()}}});
    reach_goal(0);
    for (int it = 0; it < iterations && more > 0; ++it) {
      if (clock.expired()) return;
      if (limit_ - straight_ < kGain) return;
      more -= best_.found();
      step();
    }
  }

  BestPath<V>& best() { return best_; }
  int leave_start_by() const { return start_.safe[0].second; }

 private:
  static constexpr double kGain = 1e-3;  // least saving [rad]

  // Safe interval, reached at step `at`.
  struct Stay {
    int at, leave_by;
  };
  struct Node {
    Waypoint<V> waypoint;
    int parent;
    double length;  // from the start [rad]
    std::vector<Stay> stays;
  };

  void step() {
    const auto& arm = checker_.model();
    auto target = via_point(start_.q.data(), goal_.q.data(), arm.lower, arm.upper, limit_ - straight_, random_);
    if (!checker_.project(target)) return;
    const int near = nearest_within_limit(target);
    if (near < 0) return;
    const auto& from = nodes_[near].waypoint.q;
    const T d = distance(from, target);
    if (d <= T(1e-4)) return;
    auto q = towards(checker_, from, target, eta_, d);
    if (q.empty() || !checker_.is_static_free(from.data(), q.data())) return;
    auto waypoint = make_waypoint(checker_, std::move(q));
    if (waypoint.safe.empty()) return;
    checker_.evaluate(from.data(), waypoint.q.data(), waypoint.edge);
    auto stays = reached(nodes_[near], waypoint);
    if (stays.empty()) return;
    const double there = nodes_[near].length + length(from, waypoint.q);
    nodes_.push_back({std::move(waypoint), near, there, std::move(stays)});
    reach_goal(static_cast<int>(nodes_.size()) - 1);
  }

  // Returns the nearest node through which the target is within the limit, or -1.
  int nearest_within_limit(const Config<T>& target) const {
    const double on = length(target, goal_.q);
    int best = -1;
    T least = std::numeric_limits<T>::max();
    for (size_t k = 0; k < nodes_.size(); ++k) {
      const T d = squared(nodes_[k].waypoint.q, target);
      if (d >= least || nodes_[k].length + length(nodes_[k].waypoint.q, target) + on >= limit_ - kGain) continue;
      least = d;
      best = static_cast<int>(k);
    }
    return best;
  }

  std::vector<Stay> reached(const Node& from, const Waypoint<V>& waypoint) const {
    std::vector<Stay> out;
    for (const auto& [lo, hi] : waypoint.safe) {
      int arrival = kForever;
      for (const auto& stay : from.stays) {
        const int depart = earliest_departure(checker_, waypoint.edge, stay.at, stay.leave_by, lo, hi);
        if (depart >= 0) arrival = std::min(arrival, depart + waypoint.edge.steps);
      }
      if (arrival < kForever) out.push_back({arrival, hi});
    }
    return out;
  }

  // Tries the straight line to the goal.
  void reach_goal(int node) {
    const auto& from = nodes_[node].waypoint.q;
    const double whole = nodes_[node].length + length(from, goal_.q);
    if (whole >= limit_ - kGain || !checker_.is_static_free(from.data(), goal_.q.data())) return;
    TimedPath<V> path{goal_};
    checker_.evaluate(from.data(), goal_.q.data(), path[0].edge);
    for (int k = node; k >= 0; k = nodes_[k].parent) path.push_back(nodes_[k].waypoint);
    std::reverse(path.begin(), path.end());
    if (best_.offer(std::move(path), leave_start_by())) limit_ = whole;
  }

  EdgeChecker<V>& checker_;
  const Waypoint<V> start_, goal_;
  const T eta_;
  Random& random_;
  BestPath<V> best_;
  double limit_ = 0, straight_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace mmp
