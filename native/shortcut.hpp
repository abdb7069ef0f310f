// Shortcutting on the common clock: all arms on one grid of steps, stretches of it replaced by shorter ones.
//
// A stretch of one arm is changed within the time it has; a stretch of all arms at once may take less time. What is put
// in is proved clear of everything at every instant before it is kept, so a plan that was safe stays safe.
#pragma once

#include <numeric>

#include "cuts.hpp"
#include "pair_check.hpp"
#include "stretch.hpp"

namespace mmp {

template <class V>
class Shortener {
 public:
  using T = Scalar<V>;
  // rows[arm]: [steps + 1][dof] of a safe plan. Arms of different `groups` pass through each other.
  Shortener(StaticWorld<V>& world, const std::vector<std::vector<T>>& rows, std::vector<std::vector<T>> max_step,
            Levels<T> levels, const std::vector<int>& groups)
      : cell_(world.cell), prover_(world), check_(world), levels_(levels), stretches_(rows.size()) {
    for (size_t a = 0; a < rows.size(); ++a) {
      motions_.emplace_back(*cell_, static_cast<int>(a), rows[a]);
      paces_.push_back({std::move(max_step[a])});
      others_.emplace_back();
      for (size_t b = 0; b < rows.size(); ++b)
        if (b != a && groups[a] == groups[b]) others_[a].push_back(static_cast<int>(b));
    }
    measure();
  }

  const std::vector<T>& rows(int a) const { return motions_[a].q; }

  // Number of stretches that were replaced. As many attempts again as long as they shorten the ways by a share `worth`.
  int run(int attempts, double worth, Random& random, const Clock& clock) {
    clock_ = &clock;
    int kept = 0;
    for (;;) {
      const double before = excess(), least = worth * (straight() + before);
      kept += run(attempts, random);
      const double saved = before - excess();
      if (!(saved > 0 && saved >= least) || clock.expired()) return kept;
    }
  }

 private:
  static constexpr double kStraight = 1e-3;  // [rad] in all, not worth any effort
  static constexpr double kGain = 1e-4;      // least that a cut must save [rad]
  // Shares of cuts: by a via point, easing, and straight ones for the rest.
  static constexpr double kVia = 0.7, kEase = 0.2;
  static constexpr double kByChance = 0.5;                                 // of stretches are timed by chance
  static constexpr double kWholeArm = 0.2, kEven = 0.5, kAllTheWay = 0.5;  // of easings
  static constexpr int kPatience = 8, kTogether = 16, kDraws = 8;

  int run(int attempts, Random& random) {
    int kept = 0, in_vain = 0;
    tries_ = 0;
    // Windows in which there is nothing to gain are drawn again; a plan with few that have is given up in the end.
    for (int64_t it = 0; tries_ < attempts && it < int64_t{kDraws} * attempts && excess() > kStraight && last() > 1;
         ++it) {
      if ((it & 7) == 7 && clock_->expired()) break;
      // All arms at once first, as long as it helps.
      const bool together = in_vain < kPatience || it % kTogether == 0;
      const bool better = together ? cut_all(random, it) : cut_one(random);
      if (together) in_vain = better ? 0 : in_vain + 1;
      kept += better;
    }
    return kept;
  }

  int arms() const { return static_cast<int>(motions_.size()); }
  int last() const { return motions_[0].last; }
  int dof(int a) const { return motions_[a].arm->dof; }
  double apart(int a, int i, int j) const { return mmp::apart(motions_[a].at(i), motions_[a].at(j), dof(a)); }
  // What is to be gained between two steps at most.
  double detour(int a, int i, int j) const { return along_[a][j] - along_[a][i] - apart(a, i, j); }
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
    for (int a = 0; a < arms(); ++a) straight_.push_back(apart(a, 0, last()));
  }

  void measure(int a) {
    along_[a].assign(1, 0.0);
    for (int k = 0; k < last(); ++k) along_[a].push_back(along_[a].back() + apart(a, k, k + 1));
  }

  // `count` segments, at(k) the ends of one.
  template <class Ends>
  bool free_alone(int a, int count, Ends&& at) {
    results_.assign(count, {});
    prover_.alone(a, count, at, levels_, Stop::at_first_contact, results_.data(), clock_);
    return std::all_of(results_.begin(), results_.end(), [](const auto& r) { return r.free; });
  }
  bool straight_is_free(int a, int i, int j) {
    return free_alone(a, 1, [&](int) { return std::pair<const T*, const T*>(motions_[a].at(i), motions_[a].at(j)); });
  }

  bool cut_one(Random& random) {
    double at = random.uniform() * excess();
    int a = 0;
    while (a + 1 < arms() && at >= excess(a)) at -= excess(a++);
    const auto [i, j] = some_window(last(), random);
    if (detour(a, i, j) < kGain) return false;
    const double u = random.uniform();
    return u < kVia ? cut_by(a, i, j, random) : u < kVia + kEase ? cut_joints(a, i, j, random) : cut(a, i, j, random);
  }

  // The arm goes straight from where it is at step i to where it is at step j.
  bool cut(int a, int i, int j, Random& random) {
    const T *p = motions_[a].at(i), *q = motions_[a].at(j);
    const int length = j - i, drive = paces_[a].steps(p, q);
    if (drive > length) return false;
    const bool chance = random.uniform() < kByChance;
    const Timing timing = chance ? Timing::by_chance(length, drive, 0, random) : Timing{length, 0, length};
    ++tries_;
    return straight_is_free(a, i, j) && put(a, i, driven(p, q, q, dof(a), timing));
  }

  // The arm goes by way of a place that is little or no detour.
  bool cut_by(int a, int i, int j, Random& random) {
    const T *p = motions_[a].at(i), *q = motions_[a].at(j);
    const auto& arm = *motions_[a].arm;
    const auto via = via_point(p, q, arm.lower, arm.upper, detour(a, i, j) - kGain, random);
    const int length = j - i, first = std::max(1, paces_[a].steps(p, via.data())),
              second = std::max(1, paces_[a].steps(via.data(), q));
    if (first + second > length) return false;
    ++tries_;
    const std::pair<const T*, const T*> ends[2] = {{p, via.data()}, {via.data(), q}};
    if (!free_alone(a, 2, [&](int k) { return ends[k]; })) return false;
    const int drive = first + static_cast<int>(int64_t{length - first - second} * first / (first + second));
    const bool chance = random.uniform() < kByChance;
    const Timing timing =
        chance ? Timing::by_chance(length, first, second, random) : Timing{length, 0, drive, 0, length - drive};
    return put(a, i, driven(p, via.data(), q, dof(a), timing));
  }

  // One joint, or all of the arm, turns back no more, or less; the rest moves as before.
  bool cut_joints(int a, int i, int j, Random& random) {
    std::vector<T> rows(motions_[a].at(i), motions_[a].at(j) + dof(a));
    const bool whole = random.uniform() < kWholeArm, even = !whole && random.uniform() < kEven;
    const Profile profile = even ? Profile::even : random.uniform() < 0.5 ? Profile::early : Profile::late;
    const T share = random.uniform() < kAllTheWay ? T(1) : T(random.uniform());
    const int joint = random.below(dof(a));
    double gain = 0;
    for (int k = whole ? 0 : joint; k < (whole ? dof(a) : joint + 1); ++k)
      gain += ease(rows, dof(a), k, profile, share);
    if (gain < kGain) return false;
    ++tries_;
    const auto row = [&](int k) { return rows.data() + static_cast<size_t>(k) * dof(a); };
    if (!free_alone(a, j - i, [&](int k) { return std::pair<const T*, const T*>(row(k), row(k + 1)); })) return false;
    return put(a, i, rows);
  }

  // Puts rows into the arm's motion from step i on if they keep clear of all other arms.
  bool put(int a, int i, const std::vector<T>& rows) {
    const int length = static_cast<int>(rows.size()) / dof(a) - 1;
    const bool clear = all_stretches<V>(length, [&](int n, int from, int steps) {
      stretch(a, n).set(rows.data() + static_cast<size_t>(from) * dof(a), steps);
      for (auto& b : others_[a]) {
        if (check_.apart(stretch(a, n), motions_[b], i + from, levels_, clock_)) continue;
        std::swap(b, others_[a][0]);  // most likely in the way again
        return false;
      }
      return true;
    });
    if (!clear) return false;
    all_stretches<V>(length, [&](int n, int from, int) {
      stretch(a, n).need_all();
      motions_[a].take_over(i + from, stretch(a, n));
      return true;
    });
    measure(a);
    return true;
  }

  Stretch<V>& stretch(int a, int n) {
    while (static_cast<int>(stretches_[a].size()) <= n) stretches_[a].emplace_back(*cell_, a);
    return stretches_[a][n];
  }

  // All arms go straight at once, in the time that the slowest takes.
  bool cut_all(Random& random, int64_t it) {
    const auto [i, j] = it == 0 ? std::pair(0, last()) : some_window(last(), random);
    double gain = 0;
    int length = 0;
    for (int a = 0; a < arms(); ++a) {
      gain += detour(a, i, j);
      length = std::max(length, paces_[a].steps(motions_[a].at(i), motions_[a].at(j)));
    }
    if (gain < kGain || length > j - i) return false;
    ++tries_;
    for (int a = 0; a < arms(); ++a)
      if (!straight_is_free(a, i, j)) return false;
    std::vector<std::vector<T>> parts;
    for (int a = 0; a < arms(); ++a) {
      const T *p = motions_[a].at(i), *q = motions_[a].at(j);
      parts.push_back(driven(p, q, q, dof(a), {length, 0, length}));
    }
    const bool clear = all_stretches<V>(length, [&](int, int from, int steps) {
      for (int a = 0; a < arms(); ++a) {
        stretch(a, 0).set(parts[a].data() + static_cast<size_t>(from) * dof(a), steps);
        for (const int b : others_[a])
          if (b < a && !check_.apart(stretch(b, 0), stretch(a, 0), 0, levels_, clock_)) return false;
      }
      return true;
    });
    if (!clear) return false;
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
  std::vector<Pace<T>> paces_;
  std::vector<Motion<V>> motions_;
  std::vector<std::vector<int>> others_;    // of each arm, in the order in which they are looked at
  std::vector<std::vector<double>> along_;  // length from the start to each step [rad]
  std::vector<double> straight_;
  std::vector<std::vector<Stretch<V>>> stretches_;  // of each arm, used again and again
  std::vector<SegmentResult<T>> results_;
  int tries_ = 0;
  const Clock* clock_ = nullptr;  // what it ends early counts as not free
};

}  // namespace mmp
