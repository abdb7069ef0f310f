// Single-arm planning in space and time: SI-RRT* (Sim, Kim, Nam 2024, arXiv 2404.01752) with a shared static goal tree.
//
// A vertex is a pair (configuration, safe interval) with its earliest arrival. The tree grows from the start; a second
// tree, grown once from the goal without regard to constraints, is a fact about the cell that all calls share: whenever
// a new vertex reaches it, its branch is followed to the goal. Times are whole steps; an edge takes the least number of
// steps at full speed, the wait happens before it. Every path is then shortened: cost is joint movement (L1), while the
// tree looks for early arrival.
#pragma once

#include <functional>
#include <limits>

#include "constraints.hpp"
#include "random.hpp"

namespace mmp {

struct LowLevelOptions {
  int max_iterations = 2000;
  int improve_iterations = 0;  // iterations after the first solution
  int shortcuts = 40;
  double eta = 0.8;            // steering [rad], largest joint
  double goal_bias = 0.1;
  int neighbours = 6;
};

template <class T>
struct LowLevelPath {
  bool found = false;
  int iterations = 0;
  std::vector<T> positions;  // [steps + 1][dof]
  double length = 0;         // L1 [rad]
};

template <class V>
class SingleArm {
 public:
  using T = Scalar<V>;
  using Config = std::vector<T>;

  SingleArm(StaticWorld<V>& world, int arm, const T* start, const T* goal, const T* max_step, Levels<T> levels,
            uint64_t seed)
      : world_(&world), arm_(arm), dof_(world.cell->arms[arm].dof), start_(start, start + dof_), goal_(goal, goal + dof_),
        max_step_(max_step, max_step + dof_), levels_(levels), seed_(seed) {
    goal_tree_.push_back({goal_, -1});
  }

  // Grows two static trees towards each other (RRT-Connect) and keeps the way from the start as a branch of the goal's.
  bool connect_static(const LowLevelOptions& options, const Clock& clock) {
    if (connected_) return true;
    EdgeMaker<V> maker(*world_, arm_, {}, levels_, max_step_.data());
    Random random(seed_ ^ 0x5bd1e995u);
    std::vector<TreeNode> from_start{{start_, -1}};
    for (int it = 0; it < 20 * options.max_iterations; ++it) {
      if ((it & 15) == 15 && clock.expired()) return false;
      const bool forward = it % 2 == 0;
      auto& grow = forward ? from_start : goal_tree_;
      auto& other = forward ? goal_tree_ : from_start;
      const Config target = it < 2 ? (forward ? goal_ : start_) : sample(random, it);
      const int reached = extend(maker, grow, target, options.eta);
      if (reached < 0) continue;
      const Config tip = grow[reached].q;
      const int met = extend(maker, other, tip, options.eta);
      if (met < 0 || distance(other[met].q, tip) > T(1e-6)) continue;
      int node = forward ? reached : met, parent = forward ? met : reached;
      if (distance(from_start[node].q, goal_tree_[parent].q) <= T(1e-6)) node = from_start[node].parent;
      for (; node >= 0; node = from_start[node].parent) {
        goal_tree_.push_back({from_start[node].q, parent});
        parent = static_cast<int>(goal_tree_.size()) - 1;
      }
      start_in_goal_tree_ = parent;
      connected_ = true;
      return true;
    }
    return false;
  }

  LowLevelPath<T> plan(std::vector<Constraint<V>*> constraints, const LowLevelOptions& options, uint64_t seed,
                       const Clock& clock) {
    LowLevelPath<T> out;
    if (!connect_static(options, clock)) return out;
    EdgeMaker<V> maker(*world_, arm_, std::move(constraints), levels_, max_step_.data());
    Search search(*this, maker, options, seed);
    return search.run(clock);
  }

  int dof() const { return dof_; }

 private:
  struct TreeNode {
    Config q;
    int parent;
  };
  struct Knot {  // a configuration on a way, with its safe intervals and the edge that leads to it
    Config q;
    std::vector<std::pair<int, int>> safe;
    Edge<T> edge;
  };
  using Way = std::vector<Knot>;
  struct Schedule {
    bool found = false;
    int arrival = 0;
    std::vector<int> arrive, depart;  // per knot
  };

  static T distance(const Config& a, const Config& b) {
    T d = 0;
    for (size_t j = 0; j < a.size(); ++j) d = std::max(d, std::abs(a[j] - b[j]));
    return d;
  }
  static double length(const Config& a, const Config& b) {
    double d = 0;
    for (size_t j = 0; j < a.size(); ++j) d += std::abs(double(a[j]) - double(b[j]));
    return d;
  }
  static T squared(const Config& a, const Config& b) {
    T d = 0;
    for (size_t j = 0; j < a.size(); ++j) d += (a[j] - b[j]) * (a[j] - b[j]);
    return d;
  }
  static Config between(const Config& a, const Config& b, T f) {
    Config out(a.size());
    for (size_t j = 0; j < a.size(); ++j) out[j] = a[j] + f * (b[j] - a[j]);
    return out;
  }

  // Around start and goal first, farther out as it goes on: limits of two turns make most of the space a detour.
  Config sample(Random& random, int iteration) const {
    const auto& arm = world_->cell->arms[arm_];
    const double u = random.uniform();
    const double slack = u < 0.4 ? 0.8 : u < 0.8 ? 1.8 : 4.0 + 0.002 * iteration;
    Config q(dof_);
    for (int j = 0; j < dof_; ++j) {
      const double lo = std::max<double>(arm.lower[j], std::min(start_[j], goal_[j]) - slack);
      const double hi = std::min<double>(arm.upper[j], std::max(start_[j], goal_[j]) + slack);
      q[j] = T(random.uniform(lo, hi));
    }
    return q;
  }

  static int nearest(const std::vector<TreeNode>& tree, const Config& q) {
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
  static int extend(EdgeMaker<V>& maker, std::vector<TreeNode>& tree, const Config& target, double eta) {
    int at = nearest(tree, target), reached = -1;
    for (;;) {
      const T d = distance(tree[at].q, target);
      if (d <= T(1e-6)) return at;
      Config next = d <= T(eta) ? target : between(tree[at].q, target, T(eta) / d);
      if (!maker.statically_free(tree[at].q.data(), next.data())) return reached;
      tree.push_back({std::move(next), at});
      at = reached = static_cast<int>(tree.size()) - 1;
    }
  }

  // One call of the low level.
  class Search {
   public:
    Search(SingleArm& arm, EdgeMaker<V>& maker, const LowLevelOptions& options, uint64_t seed)
        : arm_(arm), maker_(maker), options_(options), random_(seed) {}

    LowLevelPath<T> run(const Clock& clock) {
      LowLevelPath<T> out;
      Knot start = knot(arm_.start_), goal = knot(arm_.goal_);
      if (start.safe.empty() || start.safe[0].first > 0 || goal.safe.empty() || goal.safe.back().second < kForever)
        return out;
      goal_safe_ = goal.safe.back();
      add_sample(std::move(start.q), start.safe);
      vertices_.push_back({0, start.safe[0].second, 0, 0, -1});
      samples_[0].vertices[0] = 0;
      // The ways that are known without sampling: straight, and along the static tree.
      try_way(straight(), clock);
      if (!best_found_) try_way(static_way(), clock);
      int first = best_found_ ? 0 : -1;
      for (int it = 0; it < options_.max_iterations; ++it) {
        if (best_found_ && it >= first + options_.improve_iterations) break;
        if ((it & 7) == 7 && clock.expired()) break;
        ++out.iterations;
        grow(it, clock);
        if (best_found_ && first < 0) first = it;
      }
      if (!best_found_) return out;
      shorten(clock);
      write(out);
      return out;
    }

   private:
    struct SampleNode {
      Config q;
      std::vector<std::pair<int, int>> safe;
      std::vector<int> vertices;  // per safe interval, -1 if not reached
    };
    struct Vertex {
      int sample, leave_by, arrival, interval, parent;
    };

    Knot knot(Config q) {
      Knot k;
      std::vector<std::pair<int, int>> windows;
      maker_.standing(q.data(), windows);
      k.safe = safe_intervals(std::move(windows));
      k.q = std::move(q);
      return k;
    }

    int add_sample(Config q, std::vector<std::pair<int, int>> safe) {
      const size_t n = safe.size();
      samples_.push_back({std::move(q), std::move(safe), std::vector<int>(n, -1)});
      return static_cast<int>(samples_.size()) - 1;
    }

    // --- ways: configurations in order, timed by dynamic programming over (knot, safe interval)

    Way straight() {
      const T d = distance(arm_.start_, arm_.goal_);
      const int pieces = std::max(1, static_cast<int>(std::ceil(d / T(options_.eta))));
      Way way;
      for (int k = 0; k <= pieces; ++k) {
        way.push_back(knot(k == pieces ? arm_.goal_ : between(arm_.start_, arm_.goal_, T(k) / T(pieces))));
        if (k > 0 && !maker_.statically_free(way[k - 1].q.data(), way[k].q.data())) return {};
        if (k > 0) maker_.touch(way[k - 1].q.data(), way[k].q.data(), way[k].edge);
      }
      return way;
    }

    Way static_way() { return along_goal_tree(arm_.start_in_goal_tree_); }

    Way along_goal_tree(int node) {
      Way way;
      for (; node >= 0; node = arm_.goal_tree_[node].parent) {
        way.push_back(knot(arm_.goal_tree_[node].q));
        const size_t k = way.size() - 1;
        if (k > 0) maker_.touch(way[k - 1].q.data(), way[k].q.data(), way[k].edge);
      }
      return way;
    }

    // Earliest arrival at the last knot (for good, so in its infinite interval) when the first is left not before
    // `ready` and not after `leave_by`.
    Schedule time(const Way& way, int ready, int leave_by) const {
      struct State {
        int arrival, leave_by, from, depart;
      };
      std::vector<std::vector<State>> table(way.size());
      table[0].push_back({ready, leave_by, -1, 0});
      for (size_t k = 1; k < way.size(); ++k) {
        for (const auto& [lo, hi] : way[k].safe) {
          if (k + 1 == way.size() && hi < kForever) continue;
          State best{std::numeric_limits<int>::max(), hi, -1, 0};
          for (size_t p = 0; p < table[k - 1].size(); ++p) {
            const auto& parent = table[k - 1][p];
            const int depart = earliest_departure(maker_, way[k].edge, parent.arrival, parent.leave_by, lo, hi);
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

    static double cost(const Way& way, const Schedule& schedule) {
      double l1 = 0;
      for (size_t k = 1; k < way.size(); ++k) l1 += length(way[k - 1].q, way[k].q);
      return l1 + kStepCost * schedule.arrival;
    }

    void try_way(Way way, const Clock&) {
      if (way.empty()) return;
      const Schedule schedule = time(way, 0, samples_[0].safe[0].second);
      if (!schedule.found) return;
      const double c = cost(way, schedule);
      if (best_found_ && c >= best_cost_) return;
      best_found_ = true;
      best_cost_ = c;
      best_ = std::move(way);
      schedule_ = schedule;
    }

    // --- the tree

    void grow(int it, const Clock& clock) {
      const double u = random_.uniform();
      Config target;
      if (u < options_.goal_bias)
        target = arm_.goal_;
      else if (u < options_.goal_bias + 0.25)
        target = arm_.goal_tree_[random_.below(static_cast<int>(arm_.goal_tree_.size()))].q;
      else
        target = arm_.sample(random_, it);
      const int near = nearest_sample(target);
      const T d = distance(samples_[near].q, target);
      if (d <= T(1e-4)) return;
      Config q = d <= T(options_.eta) ? std::move(target) : between(samples_[near].q, target, T(options_.eta) / d);
      if (!maker_.statically_free(samples_[near].q.data(), q.data())) return;
      Knot k = knot(std::move(q));
      if (k.safe.empty()) return;
      const int sample = add_sample(std::move(k.q), std::move(k.safe));
      if (!choose_parents(sample, near)) {
        samples_.pop_back();
        return;
      }
      rewire(sample);
      reach_goal(sample, clock);
    }

    int nearest_sample(const Config& q) const {
      int best = 0;
      T least = std::numeric_limits<T>::max();
      for (size_t k = 0; k < samples_.size(); ++k) {
        const T d = squared(samples_[k].q, q);
        if (d < least) {
          least = d;
          best = static_cast<int>(k);
        }
      }
      return best;
    }

    std::vector<int> neighbours(int sample, int near) const {
      std::vector<std::pair<T, int>> within;
      for (int k = 0; k < static_cast<int>(samples_.size()); ++k)
        if (k != sample && k != near && distance(samples_[k].q, samples_[sample].q) <= T(options_.eta))
          within.emplace_back(squared(samples_[k].q, samples_[sample].q), k);
      std::sort(within.begin(), within.end());
      std::vector<int> out{near};
      for (size_t k = 0; k < within.size() && static_cast<int>(out.size()) < options_.neighbours; ++k)
        out.push_back(within[k].second);
      return out;
    }

    bool choose_parents(int sample, int near) {
      near_ = neighbours(sample, near);
      edges_.assign(near_.size(), {});
      bool any = false;
      for (size_t n = 0; n < near_.size(); ++n) {
        const int from = near_[n];
        if (n > 0 && !maker_.statically_free(samples_[from].q.data(), samples_[sample].q.data())) {
          near_[n] = -1;
          continue;
        }
        maker_.touch(samples_[from].q.data(), samples_[sample].q.data(), edges_[n]);
        for (size_t i = 0; i < samples_[sample].safe.size(); ++i) any |= offer(from, sample, static_cast<int>(i), edges_[n]);
      }
      return any;
    }

    // A way from any vertex of `from` into safe interval i of `to`; kept if it arrives earlier.
    bool offer(int from, int to, int i, const Edge<T>& edge) {
      const auto [lo, hi] = samples_[to].safe[i];
      bool any = false;
      for (const int v : samples_[from].vertices) {
        if (v < 0) continue;
        const int depart = earliest_departure(maker_, edge, vertices_[v].arrival, vertices_[v].leave_by, lo, hi);
        if (depart < 0) continue;
        const int arrival = depart + edge.steps;
        int& mine = samples_[to].vertices[i];
        if (mine < 0) {
          mine = static_cast<int>(vertices_.size());
          vertices_.push_back({to, hi, arrival, i, v});
        } else if (arrival < vertices_[mine].arrival) {
          vertices_[mine].arrival = arrival;
          vertices_[mine].parent = v;
        } else {
          continue;
        }
        any = true;
      }
      return any;
    }

    void rewire(int sample) {
      for (size_t n = 0; n < near_.size(); ++n) {
        if (near_[n] <= 0) continue;  // not free, or the start
        Edge<T> back = edges_[n];     // the same edge the other way round
        for (auto& b : back.blocked) {
          const T lo = b.lo;
          b.lo = T(1) - b.hi;
          b.hi = T(1) - lo;
        }
        for (size_t i = 0; i < samples_[near_[n]].safe.size(); ++i) offer(sample, near_[n], static_cast<int>(i), back);
      }
    }

    // From a new sample: straight to the goal, or to the goal tree and along its branch.
    void reach_goal(int sample, const Clock& clock) {
      const Config q = samples_[sample].q;
      const int node = SingleArm::nearest(arm_.goal_tree_, q);
      if (try_tail(sample, {}, clock)) return;
      if (distance(arm_.goal_tree_[node].q, q) <= T(2 * options_.eta)) try_tail(sample, along_goal_tree(node), clock);
    }

    bool try_tail(int sample, Way tail, const Clock& clock) {
      if (tail.empty()) {
        if (distance(samples_[sample].q, arm_.goal_) > T(2.5 * options_.eta)) return false;
        tail.push_back(knot(arm_.goal_));
      }
      if (!maker_.statically_free(samples_[sample].q.data(), tail[0].q.data())) return false;
      maker_.touch(samples_[sample].q.data(), tail[0].q.data(), tail[0].edge);
      bool any = false;
      for (const int v : std::vector<int>(samples_[sample].vertices)) {
        if (v < 0) continue;
        Way way = branch(v);
        way.insert(way.end(), tail.begin(), tail.end());
        const double before = best_found_ ? best_cost_ : std::numeric_limits<double>::max();
        try_way(std::move(way), clock);
        any |= best_found_ && best_cost_ < before;
      }
      return any;
    }

    Way branch(int vertex) {
      std::vector<int> order;
      for (int v = vertex; v >= 0; v = vertices_[v].parent) order.push_back(vertices_[v].sample);
      Way way;
      for (size_t k = order.size(); k-- > 0;) {
        const auto& s = samples_[order[k]];
        Knot next{s.q, s.safe, {}};
        if (!way.empty()) maker_.touch(way.back().q.data(), s.q.data(), next.edge);
        way.push_back(std::move(next));
      }
      return way;
    }

    // --- shortening

    static Edge<T> part(const Edge<T>& edge, T lo, T hi, int steps) {
      Edge<T> out;
      out.steps = steps;
      for (const auto& b : edge.blocked) {
        const T l = std::max(b.lo, lo), h = std::min(b.hi, hi);
        if (l < h) out.blocked.push_back({b.constraint, (l - lo) / (hi - lo), (h - lo) / (hi - lo)});
      }
      return out;
    }

    void shorten(const Clock& clock) {
      // First drop whole knots, then cut between random places on two edges.
      for (int it = 0; it < options_.shortcuts; ++it) {
        if (best_.size() < 3 || ((it & 7) == 7 && clock.expired())) return;
        const int edges = static_cast<int>(best_.size()) - 1;
        int i = random_.below(edges), j = random_.below(edges);
        if (i > j) std::swap(i, j);
        T f = T(random_.uniform()), g = T(random_.uniform());
        if (it % 3 == 0) f = 0, g = 1;
        if (i == j || (i + 1 == j && f == 1 && g == 0)) continue;
        cut(i, f, j, g);
      }
    }

    // Replaces what lies between place f of edge i and place g of edge j by a straight edge.
    void cut(int i, T f, int j, T g) {
      const auto &a0 = best_[i], &a1 = best_[i + 1], &b0 = best_[j], &b1 = best_[j + 1];
      Config p = between(a0.q, a1.q, f), q = g >= T(1) ? b1.q : between(b0.q, b1.q, g);
      double old = length(p, a1.q) + length(b0.q, q);
      for (int k = i + 1; k < j; ++k) old += length(best_[k].q, best_[k + 1].q);
      if (length(p, q) > old - 1e-3 && f > 0) return;
      if (!maker_.statically_free(p.data(), q.data())) return;
      Way way(best_.begin(), best_.begin() + i + 1);
      if (f > 0) {
        Knot k = knot(p);
        if (k.safe.empty()) return;
        k.edge = part(a1.edge, 0, f, maker_.steps(a0.q.data(), p.data()));
        way.push_back(std::move(k));
      }
      Knot k = knot(q);
      if (k.safe.empty()) return;
      maker_.touch(way.back().q.data(), q.data(), k.edge);
      way.push_back(std::move(k));
      if (g < 1) {
        Knot end = b1;
        end.edge = part(b1.edge, g, 1, maker_.steps(q.data(), b1.q.data()));
        way.push_back(std::move(end));
      }
      way.insert(way.end(), best_.begin() + j + 2, best_.end());
      const Schedule schedule = time(way, 0, samples_[0].safe[0].second);
      if (!schedule.found) return;
      const double c = cost(way, schedule);
      if (c >= best_cost_ - 1e-6) return;
      best_cost_ = c;
      best_ = std::move(way);
      schedule_ = schedule;
    }

    void write(LowLevelPath<T>& out) const {
      const int dof = arm_.dof_;
      out.found = true;
      out.positions.resize(static_cast<size_t>(schedule_.arrival + 1) * dof);
      const auto put = [&](int step, const Config& q) { std::copy(q.begin(), q.end(), out.positions.begin() + step * dof); };
      for (size_t k = 0; k < best_.size(); ++k) {
        for (int s = schedule_.arrive[k]; s <= schedule_.depart[k]; ++s) put(s, best_[k].q);
        if (k + 1 == best_.size()) break;
        const int steps = best_[k + 1].edge.steps;
        for (int s = 1; s < steps; ++s)
          put(schedule_.depart[k] + s, between(best_[k].q, best_[k + 1].q, T(s) / T(steps)));
        out.length += length(best_[k].q, best_[k + 1].q);
      }
    }

    static constexpr double kStepCost = 0.05;  // [rad] that an arrival one step earlier is worth

    SingleArm& arm_;
    EdgeMaker<V>& maker_;
    const LowLevelOptions& options_;
    Random random_;
    std::pair<int, int> goal_safe_{};
    std::vector<SampleNode> samples_;
    std::vector<Vertex> vertices_;
    std::vector<int> near_;
    std::vector<Edge<T>> edges_;
    bool best_found_ = false;
    double best_cost_ = 0;
    Way best_;
    Schedule schedule_;
  };

  StaticWorld<V>* world_;
  int arm_, dof_;
  Config start_, goal_, max_step_;
  Levels<T> levels_;
  uint64_t seed_;
  std::vector<TreeNode> goal_tree_;
  bool connected_ = false;
  int start_in_goal_tree_ = -1;
};

}  // namespace mmp
