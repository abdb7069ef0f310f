// Ways: configurations in order, timed by dynamic programming over (configuration, safe interval), and made shorter.
#pragma once

#include <limits>

#include "departures.hpp"
#include "random.hpp"

namespace mmp {

template <class T>
using Config = std::vector<T>;

// Largest difference of any joint [rad].
template <class T>
T distance(const Config<T>& a, const Config<T>& b) {
  T d = 0;
  for (size_t j = 0; j < a.size(); ++j) d = std::max(d, std::abs(a[j] - b[j]));
  return d;
}

// Sum over the joints, in double: costs are compared [rad].
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

// A configuration on a way, its safe intervals, and the edge that leads to it.
template <class V>
struct Knot {
  Config<Scalar<V>> q;
  std::vector<std::pair<int, int>> safe;
  Edge<V> edge;
};
template <class V>
using Way = std::vector<Knot<V>>;

// When each knot of a way is reached and left.
struct Schedule {
  bool found = false;
  int arrival = 0;
  std::vector<int> arrive, depart;
};

inline constexpr double kStepCost = 0.05;  // [rad] that an arrival one step earlier is worth

template <class V>
double cost(const Way<V>& way, const Schedule& schedule) {
  double l1 = 0;
  for (size_t k = 1; k < way.size(); ++k) l1 += length(way[k - 1].q, way[k].q);
  return l1 + kStepCost * schedule.arrival;
}

template <class V>
Knot<V> make_knot(EdgeMaker<V>& maker, Config<Scalar<V>> q) {
  Knot<V> k;
  std::vector<Window> windows;
  maker.standing(q.data(), windows);
  k.safe = safe_intervals(std::move(windows));
  k.q = std::move(q);
  return k;
}

// Earliest arrival at the last knot for good, so in its infinite interval; the first is left by `leave_by` at the
// latest.
template <class V>
Schedule time_way(const EdgeMaker<V>& maker, const Way<V>& way, int leave_by) {
  struct State {
    int arrival, leave_by, from, depart;
  };
  std::vector<std::vector<State>> table(way.size());
  if (way.size() == 1 && leave_by < kForever) return {};  // to stay is no way out of a place that is not safe for good
  table[0].push_back({0, leave_by, -1, 0});
  for (size_t k = 1; k < way.size(); ++k) {
    for (const auto& [lo, hi] : way[k].safe) {
      if (k + 1 == way.size() && hi < kForever) continue;
      State best{std::numeric_limits<int>::max(), hi, -1, 0};
      for (size_t p = 0; p < table[k - 1].size(); ++p) {
        const auto& parent = table[k - 1][p];
        const int depart = earliest_departure(maker, way[k].edge, parent.arrival, parent.leave_by, lo, hi);
        if (depart >= 0 && depart + way[k].edge.steps < best.arrival)
          best = {depart + way[k].edge.steps, hi, static_cast<int>(p), depart};
      }
      if (best.from >= 0) table[k].push_back(best);
    }
    if (table[k].empty()) return {};
  }
  Schedule out;
  out.found = true;
  out.arrive.resize(way.size());
  out.depart.resize(way.size());
  int at = 0;
  for (size_t s = 1; s < table.back().size(); ++s)
    if (table.back()[s].arrival < table.back()[at].arrival) at = static_cast<int>(s);
  out.arrival = table.back()[at].arrival;
  for (size_t k = way.size(); k-- > 0;) {
    const auto& state = table[k][at];
    out.arrive[k] = state.arrival;
    if (k > 0) out.depart[k - 1] = state.depart;
    at = state.from;
  }
  out.depart.back() = out.arrival;
  return out;
}

// The best way so far, and attempts to shorten it.
template <class V>
class BestWay {
 public:
  using T = Scalar<V>;
  BestWay(EdgeMaker<V>& maker) : maker_(&maker) {}

  bool found() const { return found_; }
  const Way<V>& knots() const { return way_; }

  // Takes the way if it can be timed and costs less.
  bool offer(Way<V> way, int leave_by) {
    if (way.empty()) return false;
    Schedule schedule = time_way(*maker_, way, leave_by);
    if (!schedule.found) return false;
    const double c = mmp::cost(way, schedule);
    if (found_ && c >= cost_ - 1e-6) return false;
    found_ = true;
    cost_ = c;
    way_ = std::move(way);
    schedule_ = std::move(schedule);
    return true;
  }

  // Straight edges between random places; every third time from knot to knot.
  void shorten(int attempts, int leave_by, Random& random, const Clock& clock) {
    for (int it = 0; it < attempts; ++it) {
      if (way_.size() < 3 || ((it & 7) == 7 && clock.expired())) return;
      const int edges = static_cast<int>(way_.size()) - 1;
      int i = random.below(edges), j = random.below(edges);
      if (i > j) std::swap(i, j);
      T f = T(random.uniform()), g = T(random.uniform());
      if (it % 3 == 0) f = 0, g = 1;
      if (i == j || (i + 1 == j && f == 1 && g == 0)) continue;
      cut(i, f, j, g, leave_by);
    }
  }

  // Configurations on the grid [arrival + 1][dof].
  void write(int dof, std::vector<T>& positions) const {
    positions.resize(static_cast<size_t>(schedule_.arrival + 1) * dof);
    const auto put = [&](int step, const Config<T>& q) {
      std::copy(q.begin(), q.end(), positions.begin() + step * dof);
    };
    for (size_t k = 0; k < way_.size(); ++k) {
      for (int s = schedule_.arrive[k]; s <= schedule_.depart[k]; ++s) put(s, way_[k].q);
      if (k + 1 == way_.size()) break;
      const int steps = way_[k + 1].edge.steps;
      for (int s = 1; s < steps; ++s) put(schedule_.depart[k] + s, between(way_[k].q, way_[k + 1].q, T(s) / T(steps)));
    }
  }

 private:
  // Replaces what lies between place f of edge i and place g of edge j.
  void cut(int i, T f, int j, T g, int leave_by) {
    const auto &a0 = way_[i], &a1 = way_[i + 1], &b0 = way_[j], &b1 = way_[j + 1];
    Config<T> p = between(a0.q, a1.q, f), q = g >= T(1) ? b1.q : between(b0.q, b1.q, g);
    double old = length(p, a1.q) + length(b0.q, q);
    for (int k = i + 1; k < j; ++k) old += length(way_[k].q, way_[k + 1].q);
    if (length(p, q) > old - 1e-3 && f > 0) return;
    // What it costs if it never has to wait.
    int steps =
        maker_->steps(a0.q.data(), p.data()) + maker_->steps(p.data(), q.data()) + maker_->steps(q.data(), b1.q.data());
    for (int k = 1; k < static_cast<int>(way_.size()); ++k)
      if (k <= i || k > j + 1) steps += way_[k].edge.steps;
    if (length(p, q) - old + kStepCost * (steps - schedule_.arrival) >= -1e-6) return;
    if (!maker_->statically_free(p.data(), q.data())) return;
    Way<V> way(way_.begin(), way_.begin() + i + 1);
    if (f > 0) {
      auto k = make_knot(*maker_, p);
      if (k.safe.empty()) return;
      k.edge = maker_->part(a1.edge, 0, f, a0.q.data(), p.data());
      way.push_back(std::move(k));
    }
    auto k = make_knot(*maker_, q);
    if (k.safe.empty()) return;
    maker_->touch(way.back().q.data(), q.data(), k.edge);
    way.push_back(std::move(k));
    if (g < 1) {
      Knot<V> end = b1;
      end.edge = maker_->part(b1.edge, g, 1, q.data(), b1.q.data());
      way.push_back(std::move(end));
    }
    way.insert(way.end(), way_.begin() + j + 2, way_.end());
    offer(std::move(way), leave_by);
  }

  EdgeMaker<V>* maker_;
  bool found_ = false;
  double cost_ = 0;
  Way<V> way_;
  Schedule schedule_;
};

}  // namespace mmp
