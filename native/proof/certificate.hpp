// Certificate of a plan: a clearance that all bodies keep at every instant, in double precision.
#pragma once

#include <optional>

#include "proof/near_arms.hpp"
#include "proof/segments.hpp"

namespace mmp {

struct Proof {
  bool valid = false;
  double clearance = 0;        // proved between arms [m]; if not valid, a clearance that is not kept
  int arm_a = -1, arm_b = -1;  // arm_b -1: arm_a alone (obstacles, bases, itself)
  int segment = 0;             // segment of the violation, or of the least sampled clearance
  double fraction = 0;
};

template <class V>
class Certifier {
 public:
  using T = Scalar<V>;
  // positions[arm]: [n][dof] at n common times. `required.proof` is the clearance to prove.
  Certifier(StaticWorld<V>& world, std::vector<const T*> positions, int n, Levels<T> required)
      : world_(&world), prover_(world), positions_(std::move(positions)), n_(n), required_(required) {
    for (int a = 0; a < arms(); ++a) {
      auto& moves = moves_.emplace_back(n > 1 ? n - 1 : 0);
      for (int s = 0; s + 1 < n; ++s) {
        const auto [from, to] = segment(a, s);
        moves[s] = !std::equal(from, from + dof(a), to);
      }
    }
  }

  // Proves the required clearance at least, and all but a `share` of what the sampled minimum has beyond it. Clearances
  // are those between arms; `required` shifts the others.
  Proof run(T share, const Clock& clock) {
    Proof out = sample(share, clock);
    const T required = required_.proof;
    if (out.clearance < required) return out;
    T beyond = (T(out.clearance) - required) * (T(1) - share);
    while (!clock.expired()) {
      Proof found;
      const T target = required + beyond;
      if (prove(target, found, clock)) {
        out.valid = true;
        out.clearance = target;
        return out;
      }
      if (clock.expired()) break;
      if (beyond == T(0)) return found;
      // Some instant is closer than all samples: aim lower.
      beyond = beyond > required / 8 ? beyond / 4 : T(0);
    }
    out.clearance = 0;
    return out;
  }

 private:
  int dof(int a) const { return world_->cell->arms[a].dof; }
  int arms() const { return static_cast<int>(positions_.size()); }
  std::pair<const T*, const T*> segment(int a, int s) const {
    const T* p = positions_[a] + static_cast<size_t>(s) * dof(a);
    return {p, p + dof(a)};
  }
  // Returns whether an arm moves in any segment from `first` to `last`.
  bool moves_in(int a, int first, int last) const {
    const auto& moves = moves_[a];
    return std::any_of(moves.begin() + first, moves.begin() + std::min(last + 1, n_ - 1), [](bool m) { return m; });
  }

  // Returns the instants that are sampled, in halves of a segment: the given times, and halfway along segments in which
  // some joint moves far. The smaller the `share`, the closer the proof comes to the samples, and the more there are.
  std::vector<int> instants(T share) const {
    const T short_move = share * kShort;
    std::vector<int> out;
    for (int s = 0; s < n_; ++s) {
      out.push_back(2 * s);
      T longest = 0;
      for (int a = 0; a < arms() && s + 1 < n_ && longest <= short_move; ++a)
        longest = std::max(longest, longest_move(segment(a, s), dof(a)));
      if (longest > short_move) out.push_back(2 * s + 1);
    }
    return out;
  }

  // Samples the clearance until the clock has expired. Where arms stand, their first sample is enough.
  Proof sample(T share, const Clock& clock) {
    Proof out;
    out.clearance = 1e9;
    std::vector<Pose<V>> poses;
    poses.reserve(arms());
    for (const auto& arm : world_->cell->arms) poses.emplace_back(arm);
    std::vector<Box<T>> boxes(arms());
    std::vector<std::vector<int>> near(arms());
    BoxSweep<T> sweep;
    std::vector<bool> stands(arms());
    const auto halves = instants(share);
    for (size_t h = 0; h < halves.size() && !clock.expired(); h += width<V>) {
      int at[width<V>];
      for (size_t lane = 0; lane < width<V>; ++lane) at[lane] = halves[std::min(h + lane, halves.size() - 1)];
      for (int a = 0; a < arms(); ++a) {
        near[a].clear();
        const bool stood = stands[a];  // then all lanes of its pose are the same
        stands[a] = h > 0 && !moves_in(a, halves[h - 1] / 2, at[width<V> - 1] / 2);
        if (stands[a] && stood) continue;
        V q[kMaxDof];
        for (int lane = 0; lane < width<V>; ++lane) {
          const int k = at[lane];
          const T *lo = positions_[a] + (k / 2) * dof(a), *hi = positions_[a] + ((k + 1) / 2) * dof(a);
          for (int j = 0; j < dof(a); ++j) q[j][lane] = (lo[j] + hi[j]) / 2;
        }
        forward(q, poses[a]);
        boxes[a] = {};
        visit_bounds<V>(
            poses[a], width<V>, [](int) { return V{}; },
            [&](int, int axis, T low, T high) { boxes[a].include(axis, low, high); });
      }
      sweep(boxes.data(), arms(), T(out.clearance) + kBoxSlack<T>, [&](int a, int b) { near[a].push_back(b); });
      for (int a = 0; a < arms(); ++a) {
        V best = splat<V>(T(out.clearance));
        if (!stands[a]) {
          world_->lower(a, poses[a], required_, best);
          if (poses[a].arm->upright) {
            const V room = upright_room(poses[a]) - required_.upright;
            best = select<V>(room < splat<V>(required_.proof), min(best, room), best);
          }
          note(best, a, -1, at, out);
        }
        std::sort(near[a].begin(), near[a].end());
        for (const int b : near[a]) {
          if (stands[a] && stands[b]) continue;
          if (!boxes[a].near(boxes[b], T(out.clearance) + kBoxSlack<T>)) continue;
          best = splat<V>(T(out.clearance));
          lower_pair_clearance(poses[a], poses[b], false, best);
          note(best, a, b, at, out);
        }
      }
    }
    return out;
  }

  // `at`: instant of each lane, in halves of a segment.
  void note(V best, int a, int b, const int* at, Proof& out) const {
    for (int lane = 0; lane < width<V>; ++lane)
      if (best[lane] < out.clearance) out = {false, best[lane], a, b, at[lane] / 2, (at[lane] % 2) / 2.0};
  }

  bool prove(T target, Proof& found, const Clock& clock) {
    const Levels<T> levels{target, target, required_.obstacles, required_.self,
                           required_.proof - target + required_.upright};
    const int segments = n_ - 1;
    std::vector<int> at;
    std::vector<SegmentResult<T>> results;
    const auto of = [&](int a) { return [this, a](int s) { return segment(a, s); }; };
    const auto part = [&](int a) { return [&at, a, this](int k) { return segment(a, at[k]); }; };
    // Reports the first segment of `at` that is not free.
    const auto all_free = [&](int a, int b) {
      for (size_t k = 0; k < at.size(); ++k)
        if (!results[k].free) {
          found = {false, target, a, b, at[k], double(results[k].contact)};
          return false;
        }
      return true;
    };
    if (!near_) {
      std::vector<const ArmModel<T>*> models;
      for (const auto& arm : world_->cell->arms) models.push_back(&arm);
      near_.emplace(models, segments, of, clock);
    }
    if (clock.expired()) return false;
    near_->find(target);
    // An arm that stands in a segment is where it was at the end of the segment before.
    for (int a = 0; a < arms(); ++a) {
      at.clear();
      for (int s = 0; s < segments; ++s)
        if (s == 0 || moves_[a][s]) at.push_back(s);
      results.assign(at.size(), {});
      prover_.alone(a, static_cast<int>(at.size()), part(a), levels, Stop::at_first_contact, results.data(), &clock);
      if (!all_free(a, -1)) return false;
      const bool free = near_->others(a, [&](int b, const std::vector<int>& close) {
        at.clear();
        for (const int s : close)
          if (s == 0 || moves_[a][s] || moves_[b][s]) at.push_back(s);
        results.assign(at.size(), {});
        prover_.pair(a, b, static_cast<int>(at.size()), part(a), part(b), levels, false, results.data(), &clock);
        return all_free(a, b);
      });
      if (!free) return false;
    }
    return true;
  }

  // Largest move of a joint in a segment that is sampled at its ends only, for a share of 1 [rad, of slides m]. Samples
  // only set the target of the proof, and the middle of a short segment seldom lowers it.
  static constexpr T kShort = T(0.04);

  StaticWorld<V>* world_;
  Prover<V> prover_;
  std::optional<NearArms<V>> near_;
  std::vector<const T*> positions_;
  std::vector<std::vector<bool>> moves_;  // [arm][segment]
  int n_;
  Levels<T> required_;
};

}  // namespace mmp
