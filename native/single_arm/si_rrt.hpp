// Single-arm planning in space and time: SI-RRT* (Sim, Kim, Nam 2024, arXiv 2404.01752) with a shared static goal tree.
//
// The tree grows from the start. A second tree, grown once from the goals without constraints, is shared by all calls:
// a new sample that reaches it follows its branch to a goal (option static_tree). A path may end at any goal where the
// arm can stay for ever; of several, the nearest are tried first. Every path is then shortened: cost is joint movement
// (L1), while the tree searches for early arrival.
#pragma once

#include "single_arm/space_time_tree.hpp"

namespace mmp {

struct SingleArmSettings {
  int max_iterations = 2000;   // without a path
  int improve_iterations = 0;  // after the first path
  int shortcuts = 40;          // attempts to shorten the path
  double goal_bias = 0.1;      // share of samples at the goal
  int neighbours = 6;          // that a sample is connected to, at most
  bool direct = true;          // first tries paths that need no sampling
  bool static_tree = true;     // uses the static goal tree
};

inline constexpr int kConnectIterations = 40000;  // for the static tree, which is grown once
inline constexpr double kTreeBias = 0.25;         // share of samples drawn from the goal tree
inline constexpr int kNearGoals = 3;              // that a sample is connected to straight, at most

template <class T>
struct SingleArmPath {
  bool found = false;
  int iterations = 0;
  std::vector<T> positions;  // [steps + 1][dof]
};

// Data that all searches of one arm share.
template <class V>
struct ArmTask {
  using T = Scalar<V>;
  StaticWorld<V>* world;
  int arm;
  Config<T> start, max_step;
  std::vector<Config<T>> goals;  // the nearest to the start first
  Levels<T> levels;
  T eta;  // steering [rad], largest joint
  GoalTree<T> goal_tree;
};

// One search.
template <class V>
class SiRrt {
 public:
  using T = Scalar<V>;
  SiRrt(const ArmTask<V>& task, EdgeChecker<V>& checker, const SingleArmSettings& settings, uint64_t seed)
      : task_(task),
        checker_(checker),
        settings_(settings),
        random_(seed),
        best_(checker),
        tree_(checker, task.eta, settings.neighbours) {}

  // `experience`: rows of an earlier path, may be empty.
  SingleArmPath<T> run(const std::vector<T>& experience, const Clock& clock) {
    SingleArmPath<T> out;
    auto start = make_waypoint(checker_, task_.start);
    if (start.safe.empty() || start.safe[0].first > 0 || !any_goal_is_open()) return out;
    leave_start_by_ = start.safe[0].second;
    tree_.add_root(std::move(start));
    if (!experience.empty()) begin_with(experience, clock);
    // Paths that need no sampling: straight lines and the static tree's branch.
    if (settings_.direct && !best_.found()) offer_straight_lines(clock);
    if (settings_.direct && settings_.static_tree && !best_.found())
      best_.offer(along_goal_tree(task_.goal_tree.start), leave_start_by_);
    for (int end = best_.found() ? settings_.improve_iterations : settings_.max_iterations;
         out.iterations < end && !clock.expired();) {
      const bool found = best_.found();
      grow(out.iterations++);
      if (!found && best_.found()) end = out.iterations + settings_.improve_iterations;
    }
    if (!best_.found()) return out;
    best_.shorten(settings_.shortcuts, leave_start_by_, random_, clock);
    out.found = true;
    best_.write(checker_.dof(), out.positions);
    return out;
  }

  const SpaceTimeTree<V>& tree() const { return tree_; }

 private:
  int goals() const { return static_cast<int>(task_.goals.size()); }

  // Returns a goal with its safe intervals. The results are kept.
  const Waypoint<V>& goal(int k) {
    if (goal_waypoints_.empty()) goal_waypoints_.resize(task_.goals.size());
    if (goal_waypoints_[k].q.empty()) goal_waypoints_[k] = make_waypoint(checker_, task_.goals[k]);
    return goal_waypoints_[k];
  }
  // Returns whether the arm can stay at the goal for ever.
  bool is_open(int k) { return !goal(k).safe.empty() && goal(k).safe.back().second >= kForever; }
  bool any_goal_is_open() {
    for (int k = 0; k < goals(); ++k)
      if (is_open(k)) return true;
    return false;
  }

  // Tries the straight lines to the goals as long as they may cost less than the best path.
  void offer_straight_lines(const Clock& clock) {
    for (int k = 0; k < goals(); ++k) {
      const int steps = checker_.steps(task_.start.data(), task_.goals[k].data());
      if (best_.found() && length(task_.start, task_.goals[k]) + kStepCost * steps >= best_.cost()) continue;
      if (is_open(k)) best_.offer(straight(task_.goals[k], steps, clock), leave_start_by_);
    }
  }

  // Splits the straight line into pieces of about eta, each of them whole steps at full speed.
  TimedPath<V> straight(const Config<T>& goal, int steps, const Clock& clock) {
    const int pieces =
        std::max(1, static_cast<int>(std::min(std::ceil(distance(task_.start, goal) / task_.eta), T(kForever))));
    TimedPath<V> path;
    for (int k = 0; k <= pieces; ++k) {
      const T f = steps == 0 ? T(k == pieces) : T(static_cast<long>(steps) * k / pieces) / T(steps);
      path.push_back(make_waypoint(checker_, k == pieces ? goal : between(task_.start, goal, f)));
      if (k == 0) continue;
      if (clock.expired()) return {};
      if (!checker_.is_static_free(path[k - 1].q.data(), path[k].q.data())) return {};
      checker_.evaluate(path[k - 1].q.data(), path[k].q.data(), path[k].edge);
    }
    return path;
  }

  TimedPath<V> along_goal_tree(int node) {
    TimedPath<V> path;
    for (int before = -1; node >= 0; before = node, node = task_.goal_tree.nodes[node].parent) {
      const auto& here = goal_tree_waypoint(node);
      path.push_back({here.q, here.safe, before < 0 ? Edge<V>{} : goal_tree_waypoints_[before].edge});
    }
    return path;
  }

  // Returns a node of the goal tree, with the edge to its parent. Paths share their ends, so the results are kept.
  const Waypoint<V>& goal_tree_waypoint(int node) {
    const auto& nodes = task_.goal_tree.nodes;
    if (goal_tree_waypoints_.empty()) goal_tree_waypoints_.resize(nodes.size());
    auto& waypoint = goal_tree_waypoints_[node];
    if (!waypoint.q.empty()) return waypoint;
    waypoint = make_waypoint(checker_, nodes[node].q);
    const int next = nodes[node].parent;
    if (next >= 0) checker_.evaluate(nodes[node].q.data(), nodes[next].q.data(), waypoint.edge);
    return waypoint;
  }

  // Adds the corners of an earlier path to the tree as long as they can be reached in time. Then tries to reach the
  // goal from the last ones.
  void begin_with(const std::vector<T>& rows, const Clock& clock) {
    const auto corners = corners_of(rows);
    int at = 0, end = 0;
    for (int k = 1; k < goals(); ++k)
      if (distance(task_.goals[k], corners.back()) < distance(task_.goals[end], corners.back())) end = k;
    for (size_t k = 1; k < corners.size() && !clock.expired(); ++k) {
      if (k + 1 == corners.size() && follow(at, {goal(end)})) return;
      auto waypoint = make_waypoint(checker_, corners[k]);
      if (waypoint.safe.empty() || !checker_.is_static_free(tree_.q(at).data(), waypoint.q.data())) break;
      checker_.evaluate(tree_.q(at).data(), waypoint.q.data(), waypoint.edge);
      const int sample = tree_.attach(at, std::move(waypoint));
      if (sample < 0) break;
      at = sample;
    }
    for (int k = at; k > 0 && !best_.found() && !clock.expired(); --k) reach_goal(k);
  }

  // Returns the corners of a path on the grid: turns, changes of speed, and at least one per eta; [0] is its first row.
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
    if (u < settings_.goal_bias) target = some_goal();
    else if (settings_.static_tree && u < settings_.goal_bias + kTreeBias)
      target = task_.goal_tree.nodes[random_.below(static_cast<int>(task_.goal_tree.nodes.size()))].q;
    else if (target = sample_between(checker_.model(), task_.start, some_goal(), it, random_);
             !checker_.project(target))
      return;
    const int near = tree_.nearest(target);
    const T d = distance(tree_.q(near), target);
    if (d <= T(1e-4)) return;
    Config<T> q = towards(checker_, tree_.q(near), target, task_.eta, d);
    if (q.empty() || !checker_.is_static_free(tree_.q(near).data(), q.data())) return;
    auto waypoint = make_waypoint(checker_, std::move(q));
    if (waypoint.safe.empty()) return;
    const int sample = tree_.connect(near, std::move(waypoint));
    if (sample >= 0) reach_goal(sample);
  }

  // Draws a goal that is open.
  const Config<T>& some_goal() {
    int k = draw_goal(task_.goals.size(), random_);
    while (!is_open(k)) k = (k + 1) % goals();
    return task_.goals[k];
  }

  // Tries to reach a goal from a new sample: straight, or along the goal tree.
  void reach_goal(int sample) {
    const Config<T>& q = tree_.q(sample);
    for (const int k : goals_near(q))
      if (follow(sample, {goal(k)})) return;
    if (!settings_.static_tree) return;
    const int node = nearest(task_.goal_tree.nodes, q, [&](const auto& n) { return is_open(n.root); });
    if (distance(task_.goal_tree.nodes[node].q, q) <= T(2) * task_.eta) follow(sample, along_goal_tree(node));
  }

  // Returns the open goals that are near, the nearest first.
  std::vector<int> goals_near(const Config<T>& q) {
    std::vector<std::pair<double, int>> within;
    for (int k = 0; k < goals(); ++k)
      if (distance(q, task_.goals[k]) <= T(2.5) * task_.eta && is_open(k))
        within.emplace_back(length(q, task_.goals[k]), k);
    std::sort(within.begin(), within.end());
    std::vector<int> out;
    for (size_t k = 0; k < within.size() && static_cast<int>(k) < kNearGoals; ++k) out.push_back(within[k].second);
    return out;
  }

  bool follow(int sample, TimedPath<V> tail) {
    if (!checker_.is_static_free(tree_.q(sample).data(), tail[0].q.data())) return false;
    checker_.evaluate(tree_.q(sample).data(), tail[0].q.data(), tail[0].edge);
    bool any = false;
    for (const int v : tree_.vertices(sample)) {
      if (v < 0) continue;
      TimedPath<V> path = tree_.branch(v);
      path.insert(path.end(), tail.begin(), tail.end());
      any |= best_.offer(std::move(path), leave_start_by_);
    }
    return any;
  }

  const ArmTask<V>& task_;
  EdgeChecker<V>& checker_;
  const SingleArmSettings& settings_;
  Random random_;
  BestPath<V> best_;
  SpaceTimeTree<V> tree_;
  int leave_start_by_ = 0;
  TimedPath<V> goal_waypoints_, goal_tree_waypoints_;  // computed on demand
};

}  // namespace mmp
