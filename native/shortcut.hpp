// Shortcutting on the common clock: all arms on one grid of steps, stretches of it replaced by straight ones.
//
// A stretch of one arm is driven straight within the time it has, left and reached when chance will; a stretch of all
// arms at once may take less time. What is put in is proved clear of everything at every instant before it is kept, so
// a plan that was safe stays safe.
#pragma once

#include "pair_check.hpp"
#include "random.hpp"

namespace mmp {

template <class V>
class Shortener {
 public:
  using T = Scalar<V>;
  // rows[arm]: [steps + 1][dof] of a safe plan; `alone` and `between`: levels for one arm and for pairs.
  Shortener(StaticWorld<V>& world, const std::vector<std::vector<T>>& rows, std::vector<std::vector<T>> max_step,
            Levels<T> alone, Levels<T> between)
      : cell_(world.cell),
        prover_(world),
        check_(world),
        max_step_(std::move(max_step)),
        alone_(alone),
        between_(between) {
    for (size_t a = 0; a < rows.size(); ++a) motions_.emplace_back(*cell_, static_cast<int>(a), rows[a]);
    measure();
  }

  const std::vector<T>& rows(int a) const { return motions_[a].q; }

  // Number of stretches that were replaced.
  int run(int attempts, Random& random, const Clock& clock) {
    int kept = 0, in_vain = 0;
    tries_ = 0;
    clock_ = &clock;
    // Windows in which there is nothing to gain are drawn again; a plan with few that have is given up in the end.
    for (int64_t it = 0; tries_ < attempts && it < int64_t{kDraws} * attempts && excess() > kStraight && last() > 1;
         ++it) {
      if ((it & 7) == 7 && clock.expired()) break;
      // All arms at once first, as long as it helps.
      const bool together = in_vain < kPatience || it % kTogether == 0;
      const bool better = together ? cut_all(random, it) : cut_one(random);
      if (together) in_vain = better ? 0 : in_vain + 1;
      kept += better;
    }
    return kept;
  }

 private:
  static constexpr double kStraight = 1e-3;              // [rad] in all, not worth any effort
  static constexpr double kGain = 1e-4;                  // least that a cut must save [rad]
  static constexpr double kOneJoint = 0.5, kLate = 0.5;  // shares of cuts: of one joint; left or reached by chance
  static constexpr int kPatience = 8, kTogether = 16, kDraws = 8;

  int arms() const { return static_cast<int>(motions_.size()); }
  int last() const { return motions_[0].last; }
  double excess(int a) const { return along_[a].back() - straight_[a]; }
  double excess() const {
    double sum = 0;
    for (int a = 0; a < arms(); ++a) sum += excess(a);
    return sum;
  }

  double apart(int a, int i, int j) const {
    const T *p = motions_[a].at(i), *q = motions_[a].at(j);
    double d = 0;
    for (int k = 0; k < motions_[a].arm->dof; ++k) d += std::abs(double(q[k]) - double(p[k]));
    return d;
  }

  // Whole steps that the straight way takes at full speed.
  int steps(int a, int i, int j) const {
    const T *p = motions_[a].at(i), *q = motions_[a].at(j);
    T n = 0;
    for (int k = 0; k < motions_[a].arm->dof; ++k) n = std::max(n, std::abs(q[k] - p[k]) / max_step_[a][k]);
    return static_cast<int>(std::ceil(n - T(1e-4)));
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

  // `length` steps that stand still for `wait`, then go straight for `drive`, and stand again.
  Motion<V> stretch(int a, int i, int j, int length, int wait, int drive) const {
    const int dof = motions_[a].arm->dof;
    const T *p = motions_[a].at(i), *q = motions_[a].at(j);
    std::vector<T> rows(static_cast<size_t>(length + 1) * dof);
    for (int k = 0; k <= length; ++k) {
      const bool done = k == length || (k > 0 && k >= wait + drive);
      const T f = k <= wait ? T(0) : T(k - wait) / T(std::max(drive, 1));
      for (int n = 0; n < dof; ++n) rows[static_cast<size_t>(k) * dof + n] = done ? q[n] : p[n] + f * (q[n] - p[n]);
    }
    return Motion<V>(*cell_, a, std::move(rows));
  }

  bool free_alone(int a, int i, int j) {
    const auto at = [&](int) { return std::pair<const T*, const T*>(motions_[a].at(i), motions_[a].at(j)); };
    SegmentResult<T> result;
    prover_.alone(a, 1, at, alone_, Stop::at_first_contact, &result, clock_);
    return result.free;
  }

  std::pair<int, int> window(Random& random) const {
    const double u = random.uniform();
    int i = random.below(last() + 1), j = random.below(last() + 1);
    if (i > j) std::swap(i, j);
    if (u < 0.15) return {0, last()};
    if (u < 0.3) return {0, j};
    if (u < 0.45) return {i, last()};
    return {i, j};
  }

  bool cut_one(Random& random) {
    double at = random.uniform() * excess();
    int a = 0;
    while (a + 1 < arms() && at >= excess(a)) at -= excess(a++);
    const auto [i, j] = window(random);
    if (along_[a][j] - along_[a][i] - apart(a, i, j) < kGain) return false;
    if (random.uniform() < kOneJoint) return cut_joint(a, i, j, random);
    return cut_arm(a, i, j, random);
  }

  // The arm goes straight from where it is at step i to where it is at step j.
  bool cut_arm(int a, int i, int j, Random& random) {
    const int room = j - i, least = steps(a, i, j);
    if (least > room) return false;
    int drive = room, wait = 0;
    if (random.uniform() < kLate) {
      drive = least + random.below(room - least + 1);
      wait = random.below(room - drive + 1);
    }
    ++tries_;
    if (!free_alone(a, i, j)) return false;
    const auto part = stretch(a, i, j, room, wait, drive);
    for (int b = 0; b < arms(); ++b)
      if (b != a && !check_.apart(part, motions_[b], i, between_, clock_)) return false;
    motions_[a].take_over(i, part);
    measure(a);
    return true;
  }

  // One joint goes evenly from where it is at step i to where it is at step j; the others move as before.
  bool cut_joint(int a, int i, int j, Random& random) {
    const int dof = motions_[a].arm->dof;
    std::vector<T> rows(motions_[a].at(i), motions_[a].at(j) + dof);
    const auto at = [&](int k, int joint) -> T& { return rows[static_cast<size_t>(k) * dof + joint]; };
    const int length = j - i, joint = random.below(dof);
    double gain = -std::abs(double(at(length, joint)) - double(at(0, joint)));
    for (int k = 0; k < length; ++k) gain += std::abs(double(at(k + 1, joint)) - double(at(k, joint)));
    if (gain < kGain) return false;
    ++tries_;
    const T from = at(0, joint), to = at(length, joint);
    for (int k = 1; k < length; ++k) at(k, joint) = from + T(k) / T(length) * (to - from);
    const auto ends = [&](int k) { return std::pair<const T*, const T*>(&at(k, 0), &at(k + 1, 0)); };
    std::vector<SegmentResult<T>> results(length);
    prover_.alone(a, length, ends, alone_, Stop::at_first_contact, results.data(), clock_);
    for (const auto& r : results)
      if (!r.free) return false;
    const Motion<V> part(*cell_, a, std::move(rows));
    for (int b = 0; b < arms(); ++b)
      if (b != a && !check_.apart(part, motions_[b], i, between_, clock_)) return false;
    motions_[a].take_over(i, part);
    measure(a);
    return true;
  }

  bool cut_all(Random& random, int64_t it) {
    const auto [i, j] = it == 0 ? std::pair(0, last()) : window(random);
    double gain = 0;
    int length = 0;
    for (int a = 0; a < arms(); ++a) {
      gain += along_[a][j] - along_[a][i] - apart(a, i, j);
      length = std::max(length, steps(a, i, j));
    }
    if (gain < kGain || length > j - i) return false;
    ++tries_;
    for (int a = 0; a < arms(); ++a)
      if (!free_alone(a, i, j)) return false;
    std::vector<Motion<V>> parts;
    for (int a = 0; a < arms(); ++a) {
      parts.push_back(stretch(a, i, j, length, 0, length));
      for (int b = 0; b < a; ++b)
        if (!check_.apart(parts[b], parts[a], 0, between_, clock_)) return false;
    }
    for (int a = 0; a < arms(); ++a) splice(a, i, j, parts[a]);
    measure();
    return true;
  }

  void splice(int a, int i, int j, const Motion<V>& part) {
    const auto& old = motions_[a].q;
    const size_t dof = static_cast<size_t>(motions_[a].arm->dof);
    std::vector<T> rows(old.begin(), old.begin() + i * dof);
    rows.insert(rows.end(), part.q.begin(), part.q.end());
    rows.insert(rows.end(), old.begin() + (j + 1) * dof, old.end());
    motions_[a] = Motion<V>(*cell_, a, std::move(rows));
  }

  const CellModel<T>* cell_;
  Prover<V> prover_;
  PairCheck<V> check_;
  std::vector<std::vector<T>> max_step_;
  Levels<T> alone_, between_;
  std::vector<Motion<V>> motions_;
  std::vector<std::vector<double>> along_;  // length from the start to each step [rad]
  std::vector<double> straight_;
  int tries_ = 0;
  const Clock* clock_ = nullptr;  // what it ends early counts as not free
};

}  // namespace mmp
