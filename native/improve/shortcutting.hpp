// Shortcutting on the common clock: replaces windows of a plan by shorter motions.
//
// A change of one arm keeps the duration of the window; a change of all arms may shorten it. The last window of an arm
// may end at another of its goals. Every new part is proved clear at every instant before it is kept, so a safe plan
// stays safe.
#pragma once

#include <limits>
#include <numeric>

#include "geometry/upright_projection.hpp"
#include "improve/motion_window.hpp"
#include "improve/shortcut_moves.hpp"
#include "proof/pair_check.hpp"

namespace mmp {

struct ShortcutSettings {
  int attempts = 0;                                             // per round
  double min_saving = std::numeric_limits<double>::infinity();  // relative saving of a round that earns another one
};

template <class V>
class Shortcutter {
 public:
  using T = Scalar<V>;
  // rows: [steps + 1][dof] of a safe plan, per arm. goals: where each may end; may be empty: where it does. Arms in
  // different `groups` ignore each other.
  Shortcutter(StaticWorld<V>& world, const std::vector<std::vector<T>>& rows, std::vector<std::vector<Config<T>>> goals,
              std::vector<std::vector<T>> max_step, Levels<T> levels, const std::vector<int>& groups)
      : cell_(world.cell),
        prover_(world),
        check_(world),
        levels_(levels),
        goals_(std::move(goals)),
        windows_(rows.size()) {
    for (size_t a = 0; a < rows.size(); ++a) {
      motions_.emplace_back(*cell_, static_cast<int>(a), rows[a]);
      limits_.push_back({std::move(max_step[a])});
      upright_.emplace_back(cell_->arms[a]);
      tests_.emplace_back();
      for (size_t b = 0; b < rows.size(); ++b)
        if (groups[a] == groups[b]) {
          tests_[a].push_back(static_cast<int>(b));
          if (b <= a) tests_together_.push_back({static_cast<int>(b), static_cast<int>(a)});
        }
    }
    measure();
  }

  const std::vector<T>& rows(int a) const { return motions_[a].q; }

  // Returns the number of replaced windows. Repeats the attempts while a round saves at least the share `min_saving` of
  // the length.
  int run(const ShortcutSettings& settings, Random& random, const Clock& clock) {
    clock_ = &clock;
    int kept = 0;
    for (;;) {
      const double before = excess(), least = settings.min_saving * (straight() + before);
      kept += run(settings.attempts, random);
      const double saved = before - excess();
      if (!(saved > 0 && saved >= least) || clock.expired()) return kept;
    }
  }

 private:
  static constexpr double kStraight = 1e-3;  // detour of the whole plan not worth an attempt [rad]
  static constexpr double kGain = 1e-4;      // least saving of an attempt [rad]
  // Shares of attempts: via point, backtracking; straight lines for the rest.
  static constexpr double kVia = 0.7, kBacktracking = 0.2;
  static constexpr double kByChance = 0.5;                                 // share of windows with a random schedule
  static constexpr double kWholeArm = 0.2, kEven = 0.5, kAllTheWay = 0.5;  // shares of backtracking attempts
  static constexpr double kOtherGoal = 0.1;  // share of attempts to end at another goal, where an arm has several
  static constexpr int kPatience = 8, kTogether = 16, kDraws = 8;

  // The motion of an arm from step i to step j, and a shorter way to take its place.
  struct Window {
    int i, j;
    const T* to;    // where it ends
    double saving;  // by a straight line [rad]
  };

  int run(int attempts, Random& random) {
    int kept = 0, in_vain = 0;
    tries_ = 0;
    // Windows without a possible gain do not count as attempts; kDraws bounds the number of draws.
    for (int64_t it = 0; tries_ < attempts && it < int64_t{kDraws} * attempts && excess() > kStraight && last() > 1;
         ++it) {
      if (clock_->expired()) break;
      // All arms at once first, as long as it helps.
      const bool together = in_vain < kPatience || it % kTogether == 0;
      const bool better = together ? shortcut_all_arms(random, it) : shortcut_one_arm(random);
      if (together) in_vain = better ? 0 : in_vain + 1;
      kept += better;
    }
    return kept;
  }

  int arms() const { return static_cast<int>(motions_.size()); }
  int last() const { return motions_[0].last; }
  int dof(int a) const { return motions_[a].arm->dof; }
  double l1_distance(int a, int i, int j) const {
    return mmp::l1_distance(motions_[a].at(i), motions_[a].at(j), dof(a));
  }
  // Returns the largest possible saving between two steps.
  double detour(int a, int i, int j) const { return along_[a][j] - along_[a][i] - l1_distance(a, i, j); }
  double excess(int a) const { return along_[a].back() - straight_[a]; }
  double straight() const { return std::accumulate(straight_.begin(), straight_.end(), 0.0); }
  double excess() const {
    double sum = 0;
    for (int a = 0; a < arms(); ++a) sum += excess(a);
    return sum;
  }

  void measure() {
    along_.assign(arms(), {0.0});
    straight_.clear();
    for (int a = 0; a < arms(); ++a) measure(a);
    for (int a = 0; a < arms(); ++a) {
      straight_.push_back(l1_distance(a, 0, last()));
      for (const auto& goal : goals_[a])
        straight_[a] = std::min(straight_[a], mmp::l1_distance(motions_[a].at(0), goal.data(), dof(a)));
    }
  }

  void measure(int a) {
    along_[a].assign(1, 0.0);
    for (int k = 0; k < last(); ++k) along_[a].push_back(along_[a].back() + l1_distance(a, k, k + 1));
  }

  // Tests `count` segments; at(k) returns the ends of one.
  template <class Ends>
  bool free_alone(int a, int count, Ends&& at) {
    results_.assign(count, {});
    prover_.alone(a, count, at, levels_, Stop::at_first_contact, results_.data(), clock_);
    return std::all_of(results_.begin(), results_.end(), [](const auto& r) { return r.free; });
  }
  bool straight_is_free(int a, const T* p, const T* q) {
    return free_alone(a, 1, [&](int) { return std::pair<const T*, const T*>(p, q); });
  }

  bool shortcut_one_arm(Random& random) {
    double at = random.uniform() * excess();
    int a = 0;
    while (a + 1 < arms() && at >= excess(a)) at -= excess(a++);
    if (goals_[a].size() > 1 && random.uniform() < kOtherGoal) return shortcut_to_other_goal(a, random);
    const auto [i, j] = random_window(last(), random);
    const Window window{i, j, motions_[a].at(j), detour(a, i, j)};
    if (window.saving < kGain) return false;
    const double u = random.uniform();
    return u < kVia                   ? shortcut_via(a, window, random)
           : u < kVia + kBacktracking ? shortcut_backtracking(a, i, j, random)
                                      : shortcut_straight(a, window, random);
  }

  // Tries a straight line, or a path through a via point, from a random step to another goal that is nearer.
  bool shortcut_to_other_goal(int a, Random& random) {
    const int i = random_window(last(), random).first;
    if (i == last()) return false;
    std::vector<Window> nearer;
    for (const auto& goal : goals_[a]) {
      const double left = along_[a].back() - along_[a][i];
      const double saving = left - mmp::l1_distance(motions_[a].at(i), goal.data(), dof(a));
      if (saving >= kGain && !std::equal(goal.begin(), goal.end(), motions_[a].at(last())))
        nearer.push_back({i, last(), goal.data(), saving});
    }
    if (nearer.empty()) return false;
    const Window& window = nearer[random.below(static_cast<int>(nearer.size()))];
    return random.uniform() < kVia ? shortcut_via(a, window, random) : shortcut_straight(a, window, random);
  }

  // Tries the straight line.
  bool shortcut_straight(int a, const Window& window, Random& random) {
    const T *p = motions_[a].at(window.i), *q = window.to;
    const int length = window.j - window.i, drive = limits_[a].steps(p, q);
    if (drive > length) return false;
    const bool chance = random.uniform() < kByChance;
    const DriveTiming timing =
        chance ? DriveTiming::by_chance(length, drive, 0, random) : DriveTiming{length, 0, length};
    ++tries_;
    return put(a, window.i, drive_rows(p, q, q, dof(a), timing), [&] { return straight_is_free(a, p, q); });
  }

  // Tries a path through a random via point with little or no detour.
  bool shortcut_via(int a, const Window& window, Random& random) {
    const T *p = motions_[a].at(window.i), *q = window.to;
    const auto& arm = *motions_[a].arm;
    auto via = via_point(p, q, arm.lower, arm.upper, window.saving - kGain, random);
    if (!upright_[a](via.data())) return false;
    const int length = window.j - window.i, first = std::max(1, limits_[a].steps(p, via.data())),
              second = std::max(1, limits_[a].steps(via.data(), q));
    if (first + second > length) return false;
    ++tries_;
    const std::pair<const T*, const T*> ends[2] = {{p, via.data()}, {via.data(), q}};
    const int drive = first + static_cast<int>(int64_t{length - first - second} * first / (first + second));
    const bool chance = random.uniform() < kByChance;
    const DriveTiming timing = chance ? DriveTiming::by_chance(length, first, second, random)
                                      : DriveTiming{length, 0, drive, 0, length - drive};
    return put(a, window.i, drive_rows(p, via.data(), q, dof(a), timing),
               [&] { return free_alone(a, 2, [&](int k) { return ends[k]; }); });
  }

  // Tries to remove the backtracking of one joint, or of all joints; the others move as before.
  bool shortcut_backtracking(int a, int i, int j, Random& random) {
    std::vector<T> rows(motions_[a].at(i), motions_[a].at(j) + dof(a));
    const bool whole = random.uniform() < kWholeArm, even = !whole && random.uniform() < kEven;
    const Profile profile = even ? Profile::even : random.uniform() < 0.5 ? Profile::early : Profile::late;
    const T share = random.uniform() < kAllTheWay ? T(1) : T(random.uniform());
    const int joint = random.below(dof(a));
    double gain = 0;
    for (int k = whole ? 0 : joint; k < (whole ? dof(a) : joint + 1); ++k)
      gain += remove_backtracking(rows, dof(a), k, profile, share);
    if (gain < kGain) return false;
    ++tries_;
    const auto row = [&](int k) { return rows.data() + static_cast<size_t>(k) * dof(a); };
    return put(a, i, rows, [&] {
      return free_alone(a, j - i, [&](int k) { return std::pair<const T*, const T*>(row(k), row(k + 1)); });
    });
  }

  // Returns whether a candidate passes all tests. Most are rejected, so the test that rejects one is the first for the
  // next.
  template <class Test, class Passes>
  static bool pass_all(std::vector<Test>& tests, const Passes& passes) {
    const auto failed = std::find_if_not(tests.begin(), tests.end(), passes);
    if (failed == tests.end()) return true;
    std::rotate(tests.begin(), failed, failed + 1);
    return false;
  }

  // Replaces the arm's motion from step i on if the rows are clear of all other arms, and `free` says that they are
  // free alone.
  template <class Free>
  bool put(int a, int i, const std::vector<T>& rows, const Free& free) {
    const int length = static_cast<int>(rows.size()) / dof(a) - 1;
    int ready = 0;
    const auto is_clear_of = [&](int b) {
      return all_windows<V>(length, [&](int n, int from, int steps) {
        return check_.is_clear(window_of(a, rows, ready, n, from, steps), motions_[b], i + from, levels_, clock_);
      });
    };
    if (!pass_all(tests_[a], [&](int b) { return b == a ? free() : is_clear_of(b); })) return false;
    all_windows<V>(length, [&](int n, int from, int steps) {
      auto& part = window_of(a, rows, ready, n, from, steps);
      part.need_all();
      motions_[a].take_over(i + from, part);
      return true;
    });
    measure(a);
    return true;
  }

  MotionWindow<V>& window(int a, int n) {
    while (static_cast<int>(windows_[a].size()) <= n) windows_[a].emplace_back(*cell_, a);
    return windows_[a][n];
  }

  // Returns window n of a candidate of arm a: `steps` of its rows from step `from` on. The first `ready` windows of the
  // candidate are set; the others are set when they are first asked for, in their order.
  MotionWindow<V>& window_of(int a, const std::vector<T>& rows, int& ready, int n, int from, int steps) {
    auto& out = window(a, n);
    if (n == ready) {
      out.set(rows.data() + static_cast<size_t>(from) * dof(a), steps);
      ++ready;
    }
    return out;
  }

  // Tries straight lines of all arms at once, in the time of the slowest.
  bool shortcut_all_arms(Random& random, int64_t it) {
    const auto [i, j] = it == 0 ? std::pair(0, last()) : random_window(last(), random);
    double gain = 0;
    int length = 0;
    for (int a = 0; a < arms(); ++a) {
      gain += detour(a, i, j);
      length = std::max(length, limits_[a].steps(motions_[a].at(i), motions_[a].at(j)));
    }
    if (gain < kGain || length > j - i) return false;
    ++tries_;
    std::vector<std::vector<T>> parts;
    for (int a = 0; a < arms(); ++a) {
      const T *p = motions_[a].at(i), *q = motions_[a].at(j);
      parts.push_back(drive_rows(p, q, q, dof(a), {length, 0, length}));
    }
    std::vector<int> ready(arms(), 0);
    const auto part = [&](int a, int n, int from, int steps) -> MotionWindow<V>& {
      return window_of(a, parts[a], ready[a], n, from, steps);
    };
    const auto passes = [&](const std::pair<int, int>& test) {
      const auto [a, b] = test;
      if (a == b) return straight_is_free(a, motions_[a].at(i), motions_[a].at(j));
      return all_windows<V>(length, [&](int n, int from, int steps) {
        return check_.is_clear(part(a, n, from, steps), part(b, n, from, steps), 0, levels_, clock_);
      });
    };
    if (!pass_all(tests_together_, passes)) return false;
    for (int a = 0; a < arms(); ++a) splice(a, i, j, parts[a]);
    measure();
    return true;
  }

  void splice(int a, int i, int j, const std::vector<T>& part) {
    const auto& old = motions_[a].q;
    std::vector<T> rows(old.begin(), old.begin() + static_cast<ptrdiff_t>(i) * dof(a));
    rows.insert(rows.end(), part.begin(), part.end());
    rows.insert(rows.end(), old.begin() + static_cast<ptrdiff_t>(j + 1) * dof(a), old.end());
    motions_[a] = Motion<V>(*cell_, a, std::move(rows));
  }

  const CellModel<T>* cell_;
  Prover<V> prover_;
  PairCheck<V> check_;
  Levels<T> levels_;
  std::vector<StepLimits<T>> limits_;
  std::vector<std::vector<Config<T>>> goals_;
  std::vector<UprightProjection<V>> upright_;
  std::vector<Motion<V>> motions_;
  // Tests of a candidate of each arm, and of all arms at once: arms to be clear of each other, or one arm alone.
  std::vector<std::vector<int>> tests_;
  std::vector<std::pair<int, int>> tests_together_;
  std::vector<std::vector<double>> along_;  // length from the start to each step [rad]
  std::vector<double> straight_;
  std::vector<std::vector<MotionWindow<V>>> windows_;  // per arm, reused
  std::vector<SegmentResult<T>> results_;
  int tries_ = 0;
  const Clock* clock_ = nullptr;  // segments that it cuts short count as not free
};

}  // namespace mmp
