// Paths as waypoints, timed by dynamic programming over (waypoint, safe interval), and their shortcuts.
#pragma once

#include <limits>

#include "runtime/random.hpp"
#include "single_arm/departures.hpp"

namespace mmp {

inline constexpr double kSteering = 0.8;  // default steering distance [rad], largest joint

template <class T>
using Config = std::vector<T>;

// Largest joint difference [rad].
template <class T>
T distance(const Config<T>& a, const Config<T>& b) {
  T d = 0;
  for (size_t j = 0; j < a.size(); ++j) d = std::max(d, std::abs(a[j] - b[j]));
  return d;
}

// Sum of joint differences (L1), in double because costs are compared [rad].
template <class T>
double length(const Config<T>& a, const Config<T>& b) {
  double d = 0;
  for (size_t j = 0; j < a.size(); ++j) d += std::abs(double(a[j]) - double(b[j]));
  return d;
}

template <class T>
T squared(const Config<T>& a, const Config<T>& b) {
  T d = 0;
  for (size_t j = 0; j < a.size(); ++j) d += (a[j] - b[j]) * (a[j] - b[j]);
  return d;
}

template <class T>
Config<T> between(const Config<T>& a, const Config<T>& b, T f) {
  Config<T> out(a.size());
  for (size_t j = 0; j < a.size(); ++j) out[j] = a[j] + f * (b[j] - a[j]);
  return out;
}

// Waypoint of a path: configuration, safe intervals, and the edge that leads to it.
template <class V>
struct Waypoint {
  Config<Scalar<V>> q;
  std::vector<std::pair<int, int>> safe;
  Edge<V> edge;
};
template <class V>
using TimedPath = std::vector<Waypoint<V>>;

// Arrival and departure at each waypoint of a path.
struct Schedule {
  bool found = false;
  int arrival = 0;
  std::vector<int> arrive, depart;
};

inline constexpr double kStepCost = 0.05;  // [rad] per step of a later arrival

template <class V>
double cost(const TimedPath<V>& path, const Schedule& schedule) {
  double l1 = 0;
  for (size_t k = 1; k < path.size(); ++k) l1 += length(path[k - 1].q, path[k].q);
  return l1 + kStepCost * schedule.arrival;
}

template <class V>
Waypoint<V> make_waypoint(EdgeChecker<V>& checker, Config<Scalar<V>> q) {
  Waypoint<V> k;
  std::vector<Window> windows;
  checker.standing(q.data(), windows);
  k.safe = safe_intervals(std::move(windows));
  k.q = std::move(q);
  return k;
}

// Returns the schedule of earliest arrival in the last waypoint's infinite safe interval. The first waypoint is left by
// `leave_by`.
template <class V>
Schedule schedule_path(const EdgeChecker<V>& checker, const TimedPath<V>& path, int leave_by) {
  struct State {
    int arrival, leave_by, from, depart;
  };
  std::vector<std::vector<State>> table(path.size());
  if (path.size() == 1 && leave_by < kForever) return {};  // a stay cannot leave a start that is not safe forever
  table[0].push_back({0, leave_by, -1, 0});
  for (size_t k = 1; k < path.size(); ++k) {
    for (const auto& [lo, hi] : path[k].safe) {
      if (k + 1 == path.size() && hi < kForever) continue;
      State best{std::numeric_limits<int>::max(), hi, -1, 0};
      for (size_t p = 0; p < table[k - 1].size(); ++p) {
        const auto& parent = table[k - 1][p];
        const int depart = earliest_departure(checker, path[k].edge, parent.arrival, parent.leave_by, lo, hi);
        if (depart >= 0 && depart + path[k].edge.steps < best.arrival)
          best = {depart + path[k].edge.steps, hi, static_cast<int>(p), depart};
      }
      if (best.from >= 0) table[k].push_back(best);
    }
    if (table[k].empty()) return {};
  }
  Schedule out;
  out.found = true;
  out.arrive.resize(path.size());
  out.depart.resize(path.size());
  int at = 0;
  for (size_t s = 1; s < table.back().size(); ++s)
    if (table.back()[s].arrival < table.back()[at].arrival) at = static_cast<int>(s);
  out.arrival = table.back()[at].arrival;
  for (size_t k = path.size(); k-- > 0;) {
    const auto& state = table[k][at];
    out.arrive[k] = state.arrival;
    if (k > 0) out.depart[k - 1] = state.depart;
    at = state.from;
  }
  out.depart.back() = out.arrival;
  return out;
}

// Best path so far, and attempts to shorten it.
template <class V>
class BestPath {
 public:
  using T = Scalar<V>;
  BestPath(EdgeChecker<V>& checker) : checker_(&checker) {}

  bool found() const { return found_; }
  double cost() const { return cost_; }
  const TimedPath<V>& waypoints() const { return path_; }

  // Keeps the path if it can be scheduled and costs less.
  bool offer(TimedPath<V> path, int leave_by) {
    if (path.empty()) return false;
    Schedule schedule = schedule_path(*checker_, path, leave_by);
    if (!schedule.found) return false;
    const double c = mmp::cost(path, schedule);
    if (found_ && c >= cost_ - 1e-6) return false;
    found_ = true;
    cost_ = c;
    path_ = std::move(path);
    schedule_ = std::move(schedule);
    return true;
  }

  // Tries straight edges between random configurations of the path; every third time between waypoints.
  void shorten(int attempts, int leave_by, Random& random, const Clock& clock) {
    for (int it = 0; it < attempts; ++it) {
      if (path_.size() < 3 || clock.expired()) return;
      const int edges = static_cast<int>(path_.size()) - 1;
      int i = random.below(edges), j = random.below(edges);
      if (i > j) std::swap(i, j);
      T f = T(random.uniform()), g = T(random.uniform());
      if (it % 3 == 0) f = 0, g = 1;
      if (i == j || (i + 1 == j && f == 1 && g == 0)) continue;
      replace_part(i, f, j, g, leave_by);
    }
  }

  // Writes configurations on the grid, [arrival + 1][dof].
  void write(int dof, std::vector<T>& positions) const {
    positions.resize(static_cast<size_t>(schedule_.arrival + 1) * dof);
    const auto put = [&](int step, const Config<T>& q) {
      std::copy(q.begin(), q.end(), positions.begin() + step * dof);
    };
    for (size_t k = 0; k < path_.size(); ++k) {
      for (int s = schedule_.arrive[k]; s <= schedule_.depart[k]; ++s) put(s, path_[k].q);
      if (k + 1 == path_.size()) break;
      const int steps = path_[k + 1].edge.steps;
      for (int s = 1; s < steps; ++s)
        put(schedule_.depart[k] + s, between(path_[k].q, path_[k + 1].q, T(s) / T(steps)));
    }
  }

 private:
  // Replaces the part from fraction f of edge i to fraction g of edge j.
  void replace_part(int i, T f, int j, T g, int leave_by) {
    const auto &a0 = path_[i], &a1 = path_[i + 1], &b0 = path_[j], &b1 = path_[j + 1];
    Config<T> p = between(a0.q, a1.q, f), q = g >= T(1) ? b1.q : between(b0.q, b1.q, g);
    double old = length(p, a1.q) + length(b0.q, q);
    for (int k = i + 1; k < j; ++k) old += length(path_[k].q, path_[k + 1].q);
    if (length(p, q) > old - 1e-3 && f > 0) return;
    // Lower bound of the change of cost: no waiting.
    int steps = checker_->steps(a0.q.data(), p.data()) + checker_->steps(p.data(), q.data()) +
                checker_->steps(q.data(), b1.q.data());
    for (int k = 1; k < static_cast<int>(path_.size()); ++k)
      if (k <= i || k > j + 1) steps += path_[k].edge.steps;
    if (length(p, q) - old + kStepCost * (steps - schedule_.arrival) >= -1e-6) return;
    if (!checker_->is_static_free(p.data(), q.data())) return;
    TimedPath<V> path(path_.begin(), path_.begin() + i + 1);
    if (f > 0) {
      auto k = make_waypoint(*checker_, p);
      if (k.safe.empty()) return;
      k.edge = checker_->part(a1.edge, 0, f, a0.q.data(), p.data());
      path.push_back(std::move(k));
    }
    auto k = make_waypoint(*checker_, q);
    if (k.safe.empty()) return;
    checker_->evaluate(path.back().q.data(), q.data(), k.edge);
    path.push_back(std::move(k));
    if (g < 1) {
      Waypoint<V> end = b1;
      end.edge = checker_->part(b1.edge, g, 1, q.data(), b1.q.data());
      path.push_back(std::move(end));
    }
    path.insert(path.end(), path_.begin() + j + 2, path_.end());
    offer(std::move(path), leave_by);
  }

  EdgeChecker<V>* checker_;
  bool found_ = false;
  double cost_ = 0;
  TimedPath<V> path_;
  Schedule schedule_;
};

}  // namespace mmp
