// Large-neighbourhood search (Shaw 1998; for many robots MAPF-LNS, Li et al., IJCAI 2021): shortens one arm's path, and
// makes room by replanning another arm. Both may end at another of their goals.
//
// The search finds a shorter path of the arm alone, then times it among all other arms. If that fails, it times the
// path without one other arm and replans that arm. It keeps both paths if they are shorter together.
#pragma once

#include "proof/pair_check.hpp"
#include "single_arm/informed_rrt.hpp"

namespace mmp {

template <class V>
class Replanner {
 public:
  using T = Scalar<V>;
  // rows[arm]: [steps + 1][dof] of a safe plan. goals[arm]: where the arm may end; may be empty: where it does.
  Replanner(StaticWorld<V>& world, const std::vector<std::vector<T>>& rows,
            const std::vector<std::vector<Config<T>>>& goals, std::vector<std::vector<T>> max_step, Levels<T> levels)
      : world_(world), check_(world), levels_(levels), max_step_(std::move(max_step)) {
    for (int a = 0; a < static_cast<int>(rows.size()); ++a) {
      auto motion = std::make_shared<Motion<V>>(*world.cell, a, rows[a]);
      const size_t dof = motion->arm->dof;
      arms_.push_back({{rows[a].begin(), rows[a].begin() + dof}});
      Config<T> end(rows[a].end() - dof, rows[a].end());
      if (std::ranges::find(goals[a], end) == goals[a].end()) add_goal(a, std::move(end));
      for (const auto& goal : goals[a]) add_goal(a, goal);
      std::ranges::stable_sort(arms_[a].goals, {}, &Goal::straight);
      take(a, std::move(motion));
    }
  }

  // Returns rows of equal number for every arm. Arms that arrive early wait.
  std::vector<T> rows(int a) const {
    int last = 0;
    for (const auto& arm : arms_) last = std::max(last, arm.motion->last);
    auto out = arms_[a].motion->q;
    const auto end = arms_[a].end();
    for (int k = arms_[a].motion->last; k < last; ++k) out.insert(out.end(), end.begin(), end.end());
    return out;
  }

  // Returns the number of attempts that made the plan shorter.
  int run(int attempts, Random& random, const Clock& clock) {
    random_ = &random;
    clock_ = &clock;
    int kept = 0;
    for (int it = 0; it < attempts && !clock.expired(); ++it) {
      const int a = draw();
      if (a < 0) break;
      kept += attempt(a);
    }
    return kept;
  }

 private:
  static constexpr double kWorth = 0.01;                 // least detour worth an attempt [rad]
  static constexpr double kGain = 2e-3;                  // least saving of an attempt [rad]
  static constexpr double kAmong = 0.3;                  // share of attempts that search among the moving arms first
  static constexpr double kFailed = 0.2, kHopeless = 1;  // failures lower an arm's chance to be drawn
  static constexpr double kFar = 1.5;  // longer paths than this multiple of the straight line get a lower random limit
  static constexpr int kOtherGoals = 3;  // for an arm that makes room
  static constexpr int kAlone = 60, kAmongOthers = 50, kMore = 10, kShortcuts = 30;

  using Others = std::vector<const Motion<V>*>;
  using MotionOf = std::shared_ptr<const Motion<V>>;
  struct Goal {
    Config<T> q;
    double straight;  // from the start [rad]
    double failures = 0;
  };
  struct Arm {
    Config<T> start;
    std::vector<Goal> goals = {};  // the nearest first
    double length = 0;             // [rad]
    double failures = 0;
    MotionOf motion = nullptr;

    double straight() const { return goals[0].straight; }
    Config<T> end() const { return {motion->at(motion->last), motion->at(motion->last) + start.size()}; }
  };

  void add_goal(int a, Config<T> q) {
    const double straight = mmp::length(arms_[a].start, q);
    arms_[a].goals.push_back({std::move(q), straight});
  }

  void take(int a, MotionOf motion) {
    arms_[a].length = length_of(*motion);
    arms_[a].motion = std::move(motion);
    arms_[a].failures = 0;
  }

  static double length_of(const Motion<V>& m) {
    double sum = 0;
    for (int k = 0; k < m.last; ++k) sum += l1_distance(m.at(k), m.at(k + 1), m.arm->dof);
    return sum;
  }

  // Draws an arm by its detour and its failures; -1 if no arm has a detour.
  int draw() {
    std::vector<double> upto;
    double sum = 0;
    for (const auto& arm : arms_) {
      const double detour = arm.length - arm.straight();
      upto.push_back(sum += detour > kWorth ? detour / (1 + arm.failures) : 0);
    }
    if (sum == 0) return -1;
    const auto at = std::upper_bound(upto.begin(), upto.end(), random_->uniform() * sum);
    return std::min(static_cast<int>(at - upto.begin()), static_cast<int>(arms_.size()) - 1);
  }

  bool attempt(int a) {
    Arm& arm = arms_[a];
    double limit = arm.length - kGain;
    if (arm.length > kFar * arm.straight()) limit -= 0.8 * random_->uniform() * (limit - arm.straight());
    Goal& goal = draw_goal(arm, limit);
    const auto path = alone(a, goal.q, limit);
    const auto fails = [&](double failures) {
      arm.failures += failures;
      goal.failures += failures;
      return false;
    };
    if (path.empty()) return fails(kHopeless);
    const bool look = random_->uniform() < kAmong;
    if (auto found = look ? among(a, goal.q, limit, all_but(a)) : timed(a, path, all_but(a)))
      return take(a, std::move(found)), true;
    if (!look && displace(a, path)) return true;
    return fails(kFailed);
  }

  // Draws a goal of the arm by what its straight line would save, and its failures.
  Goal& draw_goal(Arm& arm, double limit) {
    if (arm.goals.size() == 1) return arm.goals[0];
    std::vector<double> upto;
    double sum = 0;
    for (const auto& goal : arm.goals)
      upto.push_back(sum += std::max(limit - goal.straight, 0.0) / (1 + goal.failures));
    const auto at = std::upper_bound(upto.begin(), upto.end(), random_->uniform() * sum);
    return arm.goals[at == upto.end() ? 0 : at - upto.begin()];
  }

  // Times the path without one other arm after the other, and replans that arm.
  bool displace(int a, const std::vector<Config<T>>& path) {
    std::vector<int> order;
    for (int b = 0; b < static_cast<int>(arms_.size()); ++b)
      if (b != a) order.push_back(b);
    for (size_t k = order.size(); k-- > 1;) std::swap(order[k], order[random_->below(static_cast<int>(k) + 1)]);
    for (const int b : order) {
      auto mine = timed(a, path, all_but(a, b));
      if (!mine) continue;
      auto rest = all_but(a, b);
      rest.push_back(mine.get());
      const double limit = arms_[b].length + arms_[a].length - length_of(*mine) - kGain;
      if (auto other = among(b, limit, rest)) {
        take(a, std::move(mine));
        take(b, std::move(other));
        return true;
      }
    }
    return false;
  }

  Others all_but(int a, int b = -1) const {
    Others out;
    for (int k = 0; k < static_cast<int>(arms_.size()); ++k)
      if (k != a && k != b) out.push_back(arms_[k].motion.get());
    return out;
  }

  EdgeChecker<V> checker(int a, const Others& others) {
    return {world_, a, {}, levels_, max_step_[a].data(), DynamicObstacles<V>(others, levels_, kPartialDeviation<T>)};
  }

  // Returns the waypoints of a path shorter than the limit that ignores other arms; empty if none is found.
  std::vector<Config<T>> alone(int a, const Config<T>& goal, double limit) {
    auto edges = checker(a, {});
    InformedRrt<V> search(edges, arms_[a].start, goal, T(kSteering), *random_);
    search.grow(limit, kAlone, 1, *clock_);
    std::vector<Config<T>> corners;
    for (const auto& waypoint : search.best().waypoints()) corners.push_back(waypoint.q);
    return corners;
  }

  // Returns a motion along the path that is clear of the others, or nullptr.
  MotionOf timed(int a, const std::vector<Config<T>>& corners, const Others& others) {
    auto edges = checker(a, others);
    TimedPath<V> path;
    for (const auto& q : corners) {
      auto waypoint = make_waypoint(edges, q);
      if (waypoint.safe.empty() || (path.empty() && waypoint.safe[0].first > 0)) return nullptr;
      if (!path.empty()) edges.evaluate(path.back().q.data(), q.data(), waypoint.edge);
      path.push_back(std::move(waypoint));
    }
    const int leave_by = path[0].safe[0].second;
    BestPath<V> best(edges);
    return best.offer(std::move(path), leave_by) ? proved(a, best, others) : nullptr;
  }

  // Returns a motion to the arm's present end, or to another of its goals, that is shorter than the limit and clear of
  // the others, or nullptr.
  MotionOf among(int a, double limit, const Others& others) {
    const auto end = arms_[a].end();
    if (auto found = among(a, end, limit, others)) return found;
    int tried = 0;
    for (const auto& goal : arms_[a].goals) {
      if (goal.straight >= limit || tried == kOtherGoals) break;
      if (goal.q == end) continue;
      ++tried;
      if (auto found = among(a, goal.q, limit, others)) return found;
    }
    return nullptr;
  }

  // Returns a motion to the goal, shorter than the limit and clear of the others, or nullptr.
  MotionOf among(int a, const Config<T>& goal, double limit, const Others& others) {
    if (limit <= mmp::length(arms_[a].start, goal)) return nullptr;
    auto edges = checker(a, others);
    InformedRrt<V> search(edges, arms_[a].start, goal, T(kSteering), *random_);
    search.grow(limit, kAmongOthers, kMore, *clock_);
    if (!search.best().found()) return nullptr;
    search.best().shorten(kShortcuts, search.leave_start_by(), *random_, *clock_);
    auto found = proved(a, search.best(), others);
    return found && length_of(*found) < limit ? found : nullptr;
  }

  MotionOf proved(int a, const BestPath<V>& path, const Others& others) {
    std::vector<T> rows;
    path.write(arms_[a].start.size(), rows);
    auto mine = std::make_shared<const Motion<V>>(*world_.cell, a, std::move(rows));
    std::vector<double> instants;
    for (const auto* other : others) {
      check_(*mine, *other, levels_, instants);
      if (!instants.empty()) return nullptr;
    }
    return mine;
  }

  StaticWorld<V>& world_;
  PairCheck<V> check_;
  Levels<T> levels_;
  std::vector<std::vector<T>> max_step_;
  std::vector<Arm> arms_;
  Random* random_ = nullptr;
  const Clock* clock_ = nullptr;
};

}  // namespace mmp
