// Shorter ways for arms with detours, for which another arm makes room if it must.
//
// A large-neighbourhood search (Shaw 1998; for many robots MAPF-LNS, Li et al., IJCAI 2021). A way that is short enough
// for an arm alone is found at once; then it is timed among all others. Where that cannot be, it is timed without one
// of them, which is planned anew among the rest: kept where the two ways together have become shorter.
#pragma once

#include "informed.hpp"
#include "pair_check.hpp"

namespace mmp {

template <class V>
class Replanner {
 public:
  using T = Scalar<V>;
  // rows[arm]: [steps + 1][dof] of a safe plan.
  Replanner(StaticWorld<V>& world, const std::vector<std::vector<T>>& rows, std::vector<std::vector<T>> max_step,
            Levels<T> levels)
      : world_(world), check_(world), levels_(levels), max_step_(std::move(max_step)) {
    for (int a = 0; a < static_cast<int>(rows.size()); ++a) {
      auto motion = std::make_shared<Motion<V>>(*world.cell, a, rows[a]);
      const size_t dof = motion->arm->dof;
      arms_.push_back({{rows[a].begin(), rows[a].begin() + dof}, {rows[a].end() - dof, rows[a].end()}});
      arms_[a].straight = mmp::length(arms_[a].start, arms_[a].goal);
      take(a, std::move(motion));
    }
  }

  // As many rows for every arm, those that are there early wait.
  std::vector<T> rows(int a) const {
    int last = 0;
    for (const auto& arm : arms_) last = std::max(last, arm.motion->last);
    auto out = arms_[a].motion->q;
    for (int k = arms_[a].motion->last; k < last; ++k)
      out.insert(out.end(), arms_[a].goal.begin(), arms_[a].goal.end());
    return out;
  }

  // Number of attempts that made the plan shorter.
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
  static constexpr double kWorth = 0.01;                 // least detour that is looked at [rad]
  static constexpr double kGain = 2e-3;                  // least that an attempt must save [rad]
  static constexpr double kAmong = 0.3;                  // share of attempts that look among the moving arms at once
  static constexpr double kFailed = 0.2, kHopeless = 1;  // how much less an arm is drawn for each failure
  static constexpr double kFar = 1.5;  // multiple of the straight way beyond which less is asked for at once
  static constexpr int kAlone = 60, kAmongOthers = 50, kMore = 10, kShortcuts = 30;
  static constexpr T kEta = T(0.8);  // steering [rad], largest joint

  using Others = std::vector<const Motion<V>*>;
  using MotionOf = std::shared_ptr<const Motion<V>>;
  struct Arm {
    Config<T> start, goal;
    double straight = 0, length = 0;  // [rad]
    double failures = 0;
    MotionOf motion = nullptr;
  };

  void take(int a, MotionOf motion) {
    arms_[a].length = length_of(*motion);
    arms_[a].motion = std::move(motion);
    arms_[a].failures = 0;
  }

  static double length_of(const Motion<V>& m) {
    double sum = 0;
    for (int k = 0; k < m.last; ++k) sum += apart(m.at(k), m.at(k + 1), m.arm->dof);
    return sum;
  }

  // An arm by its detour and its failures, or -1 if there is none with a detour.
  int draw() {
    std::vector<double> upto;
    double sum = 0;
    for (const auto& arm : arms_) {
      const double detour = arm.length - arm.straight;
      upto.push_back(sum += detour > kWorth ? detour / (1 + arm.failures) : 0);
    }
    if (sum == 0) return -1;
    const auto at = std::upper_bound(upto.begin(), upto.end(), random_->uniform() * sum);
    return std::min(static_cast<int>(at - upto.begin()), static_cast<int>(arms_.size()) - 1);
  }

  bool attempt(int a) {
    Arm& arm = arms_[a];
    double limit = arm.length - kGain;
    if (arm.length > kFar * arm.straight) limit -= 0.8 * random_->uniform() * (limit - arm.straight);
    const auto way = alone(a, limit);
    if (way.empty()) {
      arm.failures += kHopeless;
      return false;
    }
    const bool look = random_->uniform() < kAmong;
    if (auto found = look ? among(a, limit, all_but(a)) : timed(a, way, all_but(a)))
      return take(a, std::move(found)), true;
    if (!look && displace(a, way)) return true;
    arm.failures += kFailed;
    return false;
  }

  // Each of the others in turn makes room for the way.
  bool displace(int a, const std::vector<Config<T>>& way) {
    std::vector<int> order;
    for (int b = 0; b < static_cast<int>(arms_.size()); ++b)
      if (b != a) order.push_back(b);
    for (size_t k = order.size(); k-- > 1;) std::swap(order[k], order[random_->below(static_cast<int>(k) + 1)]);
    for (const int b : order) {
      auto mine = timed(a, way, all_but(a, b));
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

  EdgeMaker<V> maker(int a, const Others& others) {
    return {world_, a, {}, levels_, max_step_[a].data(), Movers<V>(others, levels_, kSomeBulge<T>)};
  }

  // The corners of a way shorter than the limit, whoever may be on it; empty if none is found.
  std::vector<Config<T>> alone(int a, double limit) {
    auto edges = maker(a, {});
    InformedRrt<V> search(edges, arms_[a].start, arms_[a].goal, kEta, *random_);
    search.grow(limit, kAlone, 1, *clock_);
    std::vector<Config<T>> corners;
    for (const auto& knot : search.best().knots()) corners.push_back(knot.q);
    return corners;
  }

  // A motion along a way that keeps clear of the others, or none.
  MotionOf timed(int a, const std::vector<Config<T>>& corners, const Others& others) {
    auto edges = maker(a, others);
    Way<V> way;
    for (const auto& q : corners) {
      auto knot = make_knot(edges, q);
      if (knot.safe.empty() || (way.empty() && knot.safe[0].first > 0)) return nullptr;
      if (!way.empty()) edges.touch(way.back().q.data(), q.data(), knot.edge);
      way.push_back(std::move(knot));
    }
    const int leave_by = way[0].safe[0].second;
    BestWay<V> best(edges);
    return best.offer(std::move(way), leave_by) ? proved(a, best, others) : nullptr;
  }

  // A motion shorter than the limit that keeps clear of the others, or none.
  MotionOf among(int a, double limit, const Others& others) {
    if (limit <= arms_[a].straight) return nullptr;
    auto edges = maker(a, others);
    InformedRrt<V> search(edges, arms_[a].start, arms_[a].goal, kEta, *random_);
    search.grow(limit, kAmongOthers, kMore, *clock_);
    if (!search.best().found()) return nullptr;
    search.best().shorten(kShortcuts, search.leave_start_by(), *random_, *clock_);
    auto found = proved(a, search.best(), others);
    return found && length_of(*found) < limit ? found : nullptr;
  }

  MotionOf proved(int a, const BestWay<V>& way, const Others& others) {
    std::vector<T> rows;
    way.write(arms_[a].start.size(), rows);
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
