// Single-arm planning in space and time: SI-RRT* (Sim, Kim, Nam 2024, arXiv 2404.01752) with a shared static goal tree.
//
// A vertex is a pair (configuration, safe interval) with its earliest arrival. The tree grows from the start; a second
// tree, grown once from the goal without regard to constraints, is a fact about the cell that all calls share: whenever
// a new vertex reaches it, its branch is followed to the goal. Times are whole steps; an edge takes the least number of
// steps at full speed, the wait happens before it. Every path is then shortened: cost is joint movement (L1), while the
// tree looks for early arrival.
#pragma once

#include "seen_tree.hpp"
#include "static_tree.hpp"

namespace mmp {

struct LowLevelOptions {
  int max_iterations = 200;
  int improve_iterations = 0;  // iterations after the first solution
  int shortcuts = 40;
  double goal_bias = 0.1;
  int neighbours = 6;
};

inline constexpr int kConnectIterations = 40000;  // of the static tree; it is grown once
inline constexpr double kTreeBias = 0.25;         // how often the tree grows towards a node of the goal's tree

template <class T>
struct LowLevelPath {
  bool found = false;
  int iterations = 0;
  std::vector<T> positions;  // [steps + 1][dof]
};

// What all searches of one arm share.
template <class V>
struct ArmTask {
  using T = Scalar<V>;
  StaticWorld<V>* world;
  int arm;
  Config<T> start, goal, max_step;
  Levels<T> levels;
  T eta;  // steering [rad], largest joint
  GoalTree<T> goal_tree;
};

// One call of the low level.
template <class V>
class SiRrt {
 public:
  using T = Scalar<V>;
  SiRrt(const ArmTask<V>& task, EdgeMaker<V>& maker, const LowLevelOptions& options, uint64_t seed)
      : task_(task), maker_(maker), options_(options), random_(seed), best_(maker) {}

  // `experience`: rows of an earlier path, may be empty.
  LowLevelPath<T> run(const std::vector<T>& experience, const Clock& clock) {
    LowLevelPath<T> out;
    auto start = make_knot(maker_, task_.start), goal = make_knot(maker_, task_.goal);
    if (start.safe.empty() || start.safe[0].first > 0 || goal.safe.empty() || goal.safe.back().second < kForever)
      return out;
    leave_start_by_ = start.safe[0].second;
    add_sample(std::move(start.q), start.safe);
    vertices_.push_back({0, leave_start_by_, 0, -1});
    samples_[0].vertices[0] = 0;
    if (!experience.empty()) begin_with(experience, clock);
    // The ways that are known without sampling: straight, and along the static tree.
    if (!best_.found()) best_.offer(straight(clock), leave_start_by_);
    if (!best_.found()) best_.offer(along_goal_tree(task_.goal_tree.start), leave_start_by_);
    int first = best_.found() ? 0 : -1;
    for (int it = 0; it < options_.max_iterations; ++it) {
      if (best_.found() && it >= first + options_.improve_iterations) break;
      if ((it & 7) == 7 && clock.expired()) break;
      ++out.iterations;
      grow(it);
      if (best_.found() && first < 0) first = it;
    }
    if (!best_.found()) return out;
    best_.shorten(options_.shortcuts, leave_start_by_, random_, clock);
    out.found = true;
    best_.write(maker_.dof(), out.positions);
    return out;
  }

  // The tree as it stands.
  void look(SeenTree<T>& out) const {
    for (const auto& v : vertices_) {
      out.positions.insert(out.positions.end(), samples_[v.sample].q.begin(), samples_[v.sample].q.end());
      out.links.insert(out.links.end(), {v.arrival, v.parent});
    }
  }

 private:
  struct Sample {
    Config<T> q;
    std::vector<std::pair<int, int>> safe;
    std::vector<int> vertices;  // per safe interval, -1 if not reached
  };
  struct Vertex {
    int sample, leave_by, arrival, parent;
  };

  int add_sample(Config<T> q, std::vector<std::pair<int, int>> safe) {
    const size_t n = safe.size();
    samples_.push_back({std::move(q), std::move(safe), std::vector<int>(n, -1)});
    return static_cast<int>(samples_.size()) - 1;
  }

  // In pieces of eta or a little more, each of them whole steps at full speed.
  Way<V> straight(const Clock& clock) {
    const int pieces = std::max(1, static_cast<int>(std::ceil(distance(task_.start, task_.goal) / task_.eta)));
    const int steps = maker_.steps(task_.start.data(), task_.goal.data());
    Way<V> way;
    for (int k = 0; k <= pieces; ++k) {
      const T f = steps == 0 ? T(k == pieces) : T(static_cast<long>(steps) * k / pieces) / T(steps);
      way.push_back(make_knot(maker_, k == pieces ? task_.goal : between(task_.start, task_.goal, f)));
      if (k == 0) continue;
      if ((k & 15) == 0 && clock.expired()) return {};
      if (!maker_.statically_free(way[k - 1].q.data(), way[k].q.data())) return {};
      maker_.touch(way[k - 1].q.data(), way[k].q.data(), way[k].edge);
    }
    return way;
  }

  Way<V> along_goal_tree(int node) {
    Way<V> way;
    for (int before = -1; node >= 0; before = node, node = task_.goal_tree.nodes[node].parent) {
      const auto& here = tree_knot(node);
      way.push_back({here.q, here.safe, before < 0 ? Edge<V>{} : tree_knots_[before].edge});
    }
    return way;
  }

  // A node of the goal's tree, with the edge that leads on from it. Ways share their ends, so what is worked out is
  // kept.
  const Knot<V>& tree_knot(int node) {
    const auto& nodes = task_.goal_tree.nodes;
    if (tree_knots_.empty()) tree_knots_.resize(nodes.size());
    auto& knot = tree_knots_[node];
    if (!knot.q.empty()) return knot;
    knot = make_knot(maker_, nodes[node].q);
    const int next = nodes[node].parent;
    if (next >= 0) maker_.touch(nodes[node].q.data(), nodes[next].q.data(), knot.edge);
    return knot;
  }

  // The corners of an earlier path become the tree's first branch, as far as they can be reached in time; from the last
  // of them that can, the goal is tried.
  void begin_with(const std::vector<T>& rows, const Clock& clock) {
    const auto corners = corners_of(rows);
    int at = 0;
    for (size_t k = 1; k < corners.size() && !clock.expired(); ++k) {
      if (k + 1 == corners.size() && follow(at, {make_knot(maker_, task_.goal)})) return;
      auto knot = make_knot(maker_, corners[k]);
      if (knot.safe.empty() || !maker_.statically_free(samples_[at].q.data(), knot.q.data())) break;
      maker_.touch(samples_[at].q.data(), knot.q.data(), knot.edge);
      const int sample = add_sample(std::move(knot.q), std::move(knot.safe));
      bool any = false;
      for (size_t i = 0; i < samples_[sample].safe.size(); ++i) any |= lead(at, sample, static_cast<int>(i), knot.edge);
      if (!any) {
        samples_.pop_back();
        break;
      }
      at = sample;
    }
    for (int k = at; k > 0 && !best_.found() && !clock.expired(); --k) reach_goal(k);
  }

  // Where a path on the grid turns, changes its speed or has gone eta; [0] is its first row.
  std::vector<Config<T>> corners_of(const std::vector<T>& rows) const {
    const size_t dof = task_.start.size(), count = rows.size() / dof;
    const auto row = [&](size_t k) { return Config<T>(rows.begin() + k * dof, rows.begin() + (k + 1) * dof); };
    std::vector<Config<T>> out{row(0)};
    for (size_t a = 0; a + 1 < count;) {
      const Config<T> from = row(a), next = row(a + 1);
      size_t b = a + 1;
      for (; b + 1 < count && distance(from, row(b + 1)) <= task_.eta; ++b)
        if (distance(row(b + 1), between(from, next, T(b + 1 - a))) > T(1e-4)) break;
      if (distance(from, row(b)) > T(1e-6)) out.push_back(row(b));
      a = b;
    }
    return out;
  }

  void grow(int it) {
    const double u = random_.uniform();
    Config<T> target;
    if (u < options_.goal_bias) target = task_.goal;
    else if (u < options_.goal_bias + kTreeBias)
      target = task_.goal_tree.nodes[random_.below(static_cast<int>(task_.goal_tree.nodes.size()))].q;
    else target = sample_between(maker_.model(), task_.start, task_.goal, it, random_);
    const int near = nearest_sample(target);
    const T d = distance(samples_[near].q, target);
    if (d <= T(1e-4)) return;
    Config<T> q = d <= task_.eta ? std::move(target) : between(samples_[near].q, target, task_.eta / d);
    if (!maker_.statically_free(samples_[near].q.data(), q.data())) return;
    auto knot = make_knot(maker_, std::move(q));
    if (knot.safe.empty()) return;
    const int sample = add_sample(std::move(knot.q), std::move(knot.safe));
    if (!choose_parents(sample, near)) {
      samples_.pop_back();
      return;
    }
    rewire(sample);
    reach_goal(sample);
  }

  int nearest_sample(const Config<T>& q) const {
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
      if (k != sample && k != near && distance(samples_[k].q, samples_[sample].q) <= task_.eta)
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
      for (size_t i = 0; i < samples_[sample].safe.size(); ++i)
        any |= lead(from, sample, static_cast<int>(i), edges_[n]);
    }
    return any;
  }

  // A way from any vertex of `from` into safe interval i of `to`; kept if it arrives earlier. Whoever hangs below a
  // vertex that is now reached earlier still leaves it in time; `time_way` makes good what the tree leaves lying.
  bool lead(int from, int to, int i, const Edge<V>& edge) {
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
        vertices_.push_back({to, hi, arrival, v});
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
      const auto back = maker_.reversed(samples_[near_[n]].q.data(), samples_[sample].q.data(), edges_[n]);
      for (size_t i = 0; i < samples_[near_[n]].safe.size(); ++i) lead(sample, near_[n], static_cast<int>(i), back);
    }
  }

  // From a new sample: straight to the goal, or to the goal's tree and along its branch.
  void reach_goal(int sample) {
    const Config<T> q = samples_[sample].q;
    if (distance(q, task_.goal) <= T(2.5) * task_.eta && follow(sample, {make_knot(maker_, task_.goal)})) return;
    const int node = nearest(task_.goal_tree.nodes, q);
    if (distance(task_.goal_tree.nodes[node].q, q) <= T(2) * task_.eta) follow(sample, along_goal_tree(node));
  }

  bool follow(int sample, Way<V> tail) {
    if (!maker_.statically_free(samples_[sample].q.data(), tail[0].q.data())) return false;
    maker_.touch(samples_[sample].q.data(), tail[0].q.data(), tail[0].edge);
    bool any = false;
    for (const int v : samples_[sample].vertices) {
      if (v < 0) continue;
      Way<V> way = branch(v);
      way.insert(way.end(), tail.begin(), tail.end());
      any |= best_.offer(std::move(way), leave_start_by_);
    }
    return any;
  }

  Way<V> branch(int vertex) {
    std::vector<int> order;
    for (int v = vertex; v >= 0; v = vertices_[v].parent) order.push_back(vertices_[v].sample);
    Way<V> way;
    for (size_t k = order.size(); k-- > 0;) {
      const auto& s = samples_[order[k]];
      Knot<V> next{s.q, s.safe, {}};
      if (!way.empty()) maker_.touch(way.back().q.data(), s.q.data(), next.edge);
      way.push_back(std::move(next));
    }
    return way;
  }

  const ArmTask<V>& task_;
  EdgeMaker<V>& maker_;
  const LowLevelOptions& options_;
  Random random_;
  BestWay<V> best_;
  int leave_start_by_ = 0;
  std::vector<Sample> samples_;
  std::vector<Vertex> vertices_;
  std::vector<int> near_;
  std::vector<Edge<V>> edges_;
  Way<V> tree_knots_;  // of the goal's tree, as far as they were needed
};

}  // namespace mmp
