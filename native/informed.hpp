// A way for one arm that is shorter than a limit: RRT in space and time, informed by the length of ways.
//
// After Informed RRT* (Gammell, Srinivasa, Barfoot 2014), in L1: a place in the box between start and goal is on a way
// as short as the straight one, a place outside costs twice what it is out. The tree keeps to places from which the
// goal can still be reached within the limit; each of their safe intervals is reached as early as can be.
#pragma once

#include "cuts.hpp"
#include "way.hpp"

namespace mmp {

template <class V>
class InformedRrt {
 public:
  using T = Scalar<V>;
  InformedRrt(EdgeMaker<V>& maker, const Config<T>& start, const Config<T>& goal, T eta, Random& random)
      : maker_(maker),
        start_(make_knot(maker, start)),
        goal_(make_knot(maker, goal)),
        eta_(eta),
        random_(random),
        best_(maker) {}

  // Grows the tree by `iterations`, or `more` after the first way. What is found is in `best`.
  void grow(double limit, int iterations, int more, const Clock& clock) {
    if (start_.safe.empty() || start_.safe[0].first > 0 || goal_.safe.empty() || goal_.safe.back().second < kForever)
      return;
    limit_ = limit;
    straight_ = length(start_.q, goal_.q);
    nodes_.push_back({start_, -1, 0, {{0, leave_start_by()}}});
    reach_goal(0);
    for (int it = 0; it < iterations && more > 0; ++it) {
      if ((it & 7) == 7 && clock.expired()) return;
      if (limit_ - straight_ < kGain) return;
      more -= best_.found();
      step();
    }
  }

  BestWay<V>& best() { return best_; }
  int leave_start_by() const { return start_.safe[0].second; }

 private:
  static constexpr double kGain = 1e-3;  // least by which a way must be shorter [rad]

  // A safe interval that was reached at step `at`.
  struct Stay {
    int at, leave_by;
  };
  struct Node {
    Knot<V> knot;
    int parent;
    double length;  // from the start [rad]
    std::vector<Stay> stays;
  };

  void step() {
    const auto& arm = maker_.model();
    const auto target = via_point(start_.q.data(), goal_.q.data(), arm.lower, arm.upper, limit_ - straight_, random_);
    const int near = nearest_on_the_way(target);
    if (near < 0) return;
    const auto& from = nodes_[near].knot.q;
    const T d = distance(from, target);
    if (d <= T(1e-4)) return;
    auto q = d <= eta_ ? target : between(from, target, eta_ / d);
    if (!maker_.statically_free(from.data(), q.data())) return;
    auto knot = make_knot(maker_, std::move(q));
    if (knot.safe.empty()) return;
    maker_.touch(from.data(), knot.q.data(), knot.edge);
    auto stays = reached(nodes_[near], knot);
    if (stays.empty()) return;
    const double there = nodes_[near].length + length(from, knot.q);
    nodes_.push_back({std::move(knot), near, there, std::move(stays)});
    reach_goal(static_cast<int>(nodes_.size()) - 1);
  }

  // The node next to a place of those by way of which it is within the limit, or -1.
  int nearest_on_the_way(const Config<T>& target) const {
    const double on = length(target, goal_.q);
    int best = -1;
    T least = std::numeric_limits<T>::max();
    for (size_t k = 0; k < nodes_.size(); ++k) {
      const T d = squared(nodes_[k].knot.q, target);
      if (d >= least || nodes_[k].length + length(nodes_[k].knot.q, target) + on >= limit_ - kGain) continue;
      least = d;
      best = static_cast<int>(k);
    }
    return best;
  }

  std::vector<Stay> reached(const Node& from, const Knot<V>& knot) const {
    std::vector<Stay> out;
    for (const auto& [lo, hi] : knot.safe) {
      int arrival = kForever;
      for (const auto& stay : from.stays) {
        const int depart = earliest_departure(maker_, knot.edge, stay.at, stay.leave_by, lo, hi);
        if (depart >= 0) arrival = std::min(arrival, depart + knot.edge.steps);
      }
      if (arrival < kForever) out.push_back({arrival, hi});
    }
    return out;
  }

  // Straight on to the goal.
  void reach_goal(int node) {
    const auto& from = nodes_[node].knot.q;
    const double whole = nodes_[node].length + length(from, goal_.q);
    if (whole >= limit_ - kGain || !maker_.statically_free(from.data(), goal_.q.data())) return;
    Way<V> way{goal_};
    maker_.touch(from.data(), goal_.q.data(), way[0].edge);
    for (int k = node; k >= 0; k = nodes_[k].parent) way.push_back(nodes_[k].knot);
    std::reverse(way.begin(), way.end());
    if (best_.offer(std::move(way), leave_start_by())) limit_ = whole;
  }

  EdgeMaker<V>& maker_;
  const Knot<V> start_, goal_;
  const T eta_;
  Random& random_;
  BestWay<V> best_;
  double limit_ = 0, straight_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace mmp
