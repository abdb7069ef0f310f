// Removes waits from a plan: every arm moves as soon as those that passed before it let it.
//
// The paths stay, and so does the order in which arms pass (temporal plan graph: Hoenig et al., ICAPS 2016). Two steps
// of two arms whose swept volumes are apart may take place at any times. Other steps keep their order. Steps that took
// place at the same time although their volumes meet take place together again.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "proof/swept_conflicts.hpp"
#include "runtime/clock.hpp"

namespace mmp {

template <class V>
class WaitRemoval {
 public:
  using T = Scalar<V>;
  using Rows = std::vector<std::vector<double>>;  // [arm][row * dof + joint]

  // `rows`: the plan's configurations at common times. `max_velocity`: of each joint of each arm [rad/s]. `distance`:
  // clearance that the arms keep [m].
  WaitRemoval(const CellModel<T>& cell, const Rows& rows, const Rows& max_velocity, T distance, const Clock& clock) {
    const int arms = static_cast<int>(cell.arms.size()), count = static_cast<int>(rows[0].size()) / cell.arms[0].dof;
    tracks_.resize(arms);
    for (int a = 0; a < arms; ++a) {
      tracks_[a].dof = cell.arms[a].dof;
      tracks_[a].path.assign(rows[a].begin(), rows[a].begin() + tracks_[a].dof);
    }
    for (int k = 0; k + 1 < count; ++k) add_segment(rows, max_velocity, k);
    for (int a = 0; a < arms; ++a) {
      auto& track = tracks_[a];
      track.motion = std::make_unique<Motion<V>>(cell, a, std::vector<T>(track.path.begin(), track.path.end()));
      track.begins.resize(track.steps());
      track.ends.resize(track.steps());
    }
    for (int a = 0; a < arms; ++a)
      for (int b = 0; b < a && !clock.expired(); ++b) {
        SweptConflicts<V> of_a(*tracks_[a].motion, *tracks_[b].motion, distance);
        SweptConflicts<V> of_b(*tracks_[b].motion, *tracks_[a].motion, distance);
        if (!of_a.any_near() || !of_b.any_near()) continue;
        const size_t at_a = tracks_[a].near.size(), at_b = tracks_[b].near.size();
        tracks_[a].near.push_back({b, at_b, std::move(of_a)});
        tracks_[b].near.push_back({a, at_a, std::move(of_b)});
      }
  }

  // Returns the configurations at new common times; nothing when time is up.
  Rows run(const Clock& clock) {
    for (int instant = 0; instant < instants_; ++instant) {
      if (clock.expired()) return {};
      const size_t first = units_.size();
      add_units(instant);
      for (size_t k = first; k < units_.size(); ++k) begin_early(units_[k]);
    }
    for (size_t k = units_.size(); k-- > 0;) {
      if (clock.expired()) return {};
      end_late(units_[k]);
    }
    return common_rows();
  }

 private:
  static constexpr double kStepRad = 0.2;    // longest step of any joint [rad, of slides m]
  static constexpr int kMostSteps = 4096;    // of one segment
  static constexpr double kSameTime = 1e-7;  // [s]
  static constexpr double kOnLine = 1e-6;    // distance of a state from a straight line that counts as on it [rad]

  struct Other {
    int arm;
    size_t back;                  // index of this arm in `near` of the other one
    SweptConflicts<V> conflicts;  // of steps of this arm with those of the other one
  };

  // The steps of one arm. Step s leads from path row s to row s + 1.
  struct Track {
    int dof;
    std::vector<double> path;
    std::vector<int> instants;         // at which instant of the plan each step takes place
    std::vector<double> durations;     // least duration of each step
    std::vector<double> begins, ends;  // new times of the steps
    std::unique_ptr<Motion<V>> motion;
    std::vector<Other> near;

    int steps() const { return static_cast<int>(instants.size()); }
    const double* row(int s) const { return path.data() + static_cast<size_t>(s) * dof; }
  };

  // Steps of some arms that take place together.
  struct Unit {
    int instant;
    std::vector<std::pair<int, int>> steps;  // arm, step
    double duration = 0;
  };

  int arms() const { return static_cast<int>(tracks_.size()); }

  // Divides a segment of the plan into equal steps for all arms.
  void add_segment(const Rows& rows, const Rows& max_velocity, int k) {
    const auto ends = [&](int a) {
      const double* from = rows[a].data() + static_cast<size_t>(k) * tracks_[a].dof;
      return std::pair(from, from + tracks_[a].dof);
    };
    double longest = 0;
    for (int a = 0; a < arms(); ++a) longest = std::max(longest, longest_move(ends(a), tracks_[a].dof));
    const int steps = static_cast<int>(std::min(std::ceil(longest / kStepRad), double(kMostSteps)));
    for (int a = 0; a < arms(); ++a) {
      auto& track = tracks_[a];
      const auto [from, to] = ends(a);
      double duration = 0;
      for (int j = 0; j < track.dof; ++j)
        duration = std::max(duration, std::abs(to[j] - from[j]) / max_velocity[a][j] / steps);
      if (!(duration > 0)) continue;
      for (int s = 1; s <= steps; ++s) {
        for (int j = 0; j < track.dof; ++j)
          track.path.push_back(s == steps ? to[j] : from[j] + (to[j] - from[j]) * s / steps);
        track.instants.push_back(instants_ + s - 1);
        track.durations.push_back(duration);
      }
    }
    instants_ += steps;
  }

  // Adds the steps of an instant. Those that may conflict with each other are one unit.
  void add_units(int instant) {
    std::vector<Unit> found;
    for (int a = 0; a < arms(); ++a) {
      const auto& track = tracks_[a];
      const int step = steps_before(track, instant);
      if (step == track.steps() || track.instants[step] != instant) continue;
      Unit unit{instant, {{a, step}}, track.durations[step]};
      for (auto& other : found)
        if (meet(other, a, step)) {
          unit.steps.insert(unit.steps.end(), other.steps.begin(), other.steps.end());
          unit.duration = std::max(unit.duration, other.duration);
          other.steps.clear();
        }
      std::erase_if(found, [](const Unit& other) { return other.steps.empty(); });
      found.push_back(std::move(unit));
    }
    std::ranges::move(found, std::back_inserter(units_));
  }

  // Returns whether a step of an arm may conflict with a unit of the same instant.
  bool meet(const Unit& unit, int arm, int step) {
    for (auto& other : tracks_[arm].near)
      for (const auto& [b, of_b] : unit.steps)
        if (b == other.arm && conflicts(arm, step, other, of_b / width<V>, of_b, of_b + 1)) return true;
    return false;
  }

  // Returns the lanes of a chunk of another arm's steps that may conflict with a step of an arm, from step `from` and
  // before step `until`. Chunk c has the steps c * width, ... The test is not symmetric, so both arms must say it.
  unsigned conflicts(int arm, int step, Other& other, int chunk, int from, int until) {
    const int first = chunk * width<V>;
    const unsigned early = first_lanes<V>(std::max(from - first, 0));
    unsigned found = other.conflicts.test(step, first, first_lanes<V>(std::min(until - first, width<V>)) & ~early);
    auto& back = tracks_[other.arm].near[other.back].conflicts;
    const int lane = step % width<V>;
    for (unsigned open = found; open; open &= open - 1) {
      const int t = std::countr_zero(open);
      if (!back.test(first + t, step - lane, 1u << lane)) found &= ~(1u << t);
    }
    return found;
  }

  // Begins a unit as soon as the steps before it with which it may conflict have ended.
  void begin_early(const Unit& unit) {
    double begin = 0;
    for (const auto& [a, step] : unit.steps)
      if (step > 0) begin = std::max(begin, tracks_[a].ends[step - 1]);
    for (const auto& [a, step] : unit.steps)
      for (auto& other : tracks_[a].near) {
        const auto& ends = tracks_[other.arm].ends;
        const int until = steps_before(tracks_[other.arm], unit.instant);
        unsigned found = 0;
        for (int chunk = (until + width<V> - 1) / width<V>; chunk-- > 0 && !found;) {
          if (ends[std::min((chunk + 1) * width<V>, until) - 1] <= begin) break;
          found = conflicts(a, step, other, chunk, 0, until);
          if (found) begin = std::max(begin, ends[chunk * width<V> + std::bit_width(found) - 1]);
        }
      }
    put(unit, begin, begin + unit.duration);
  }

  // Ends a unit as late as the steps after it let it, so that an arm waits once and not many times.
  void end_late(const Unit& unit) {
    const double ended = tracks_[unit.steps[0].first].ends[unit.steps[0].second];
    double end = std::numeric_limits<double>::infinity();
    for (const auto& [a, step] : unit.steps) {
      const auto& track = tracks_[a];
      end = std::min(end, step + 1 < track.steps() ? track.begins[step + 1] : track.ends[step]);
    }
    for (const auto& [a, step] : unit.steps)
      for (auto& other : tracks_[a].near) {
        const auto& begins = tracks_[other.arm].begins;
        const int steps = tracks_[other.arm].steps(), from = steps_before(tracks_[other.arm], unit.instant + 1);
        unsigned found = 0;
        for (int chunk = from / width<V>; std::max(chunk * width<V>, from) < steps && !found; ++chunk) {
          if (begins[std::max(chunk * width<V>, from)] >= end) break;
          found = conflicts(a, step, other, chunk, from, steps);
          if (found) end = std::min(end, begins[chunk * width<V> + std::countr_zero(found)]);
        }
      }
    if (end > ended) put(unit, end - unit.duration, end);
  }

  void put(const Unit& unit, double begin, double end) {
    for (const auto& [a, step] : unit.steps) {
      tracks_[a].begins[step] = begin;
      tracks_[a].ends[step] = end;
    }
  }

  static int steps_before(const Track& track, int instant) {
    return static_cast<int>(std::ranges::lower_bound(track.instants, instant) - track.instants.begin());
  }

  // A state of one arm. Between states it moves on a straight line.
  struct State {
    double time;
    const double* q;
  };

  // Returns the states of an arm at which it begins, ends, or changes its velocity.
  static std::vector<State> corners(const Track& track) {
    std::vector<State> all{{0, track.row(0)}};
    for (int s = 0; s < track.steps(); ++s) {
      if (track.begins[s] > all.back().time + kSameTime) all.push_back({track.begins[s], track.row(s)});
      all.push_back({track.ends[s], track.row(s + 1)});
    }
    std::vector<State> out{all[0]};
    size_t from = 0;
    for (size_t k = 1; k < all.size(); ++k)
      if (k + 1 == all.size() || !straight(&all[from], &all[k + 1], track.dof)) {
        out.push_back(all[k]);
        from = k;
      }
    return out;
  }
  // Returns whether all states from `first` to `last` are on one line.
  static bool straight(const State* first, const State* last, int dof) {
    for (const State* at = first + 1; at < last; ++at) {
      const double share = (at->time - first->time) / (last->time - first->time);
      for (int j = 0; j < dof; ++j)
        if (std::abs(first->q[j] + share * (last->q[j] - first->q[j]) - at->q[j]) > kOnLine) return false;
    }
    return true;
  }

  // Returns the configurations of all arms at the times of all corners.
  Rows common_rows() const {
    std::vector<std::vector<State>> states;
    std::vector<double> times;
    for (const auto& track : tracks_) {
      states.push_back(corners(track));
      for (const auto& state : states.back()) times.push_back(state.time);
    }
    std::ranges::sort(times);
    const auto same = [](double a, double b) { return b - a < kSameTime; };
    times.erase(std::unique(times.begin(), times.end(), same), times.end());
    Rows out(arms());
    for (int a = 0; a < arms(); ++a) {
      const State *at = states[a].data(), *last = at + states[a].size() - 1;
      for (const double time : times) {
        while (at < last && at[1].time < time + kSameTime) ++at;
        const double share = at < last ? std::max((time - at->time) / (at[1].time - at->time), 0.0) : 0.0;
        for (int j = 0; j < tracks_[a].dof; ++j)
          out[a].push_back(share > 0 ? at->q[j] + share * (at[1].q[j] - at->q[j]) : at->q[j]);
      }
    }
    return out;
  }

  int instants_ = 0;
  std::vector<Track> tracks_;
  std::vector<Unit> units_;  // by instant
};

}  // namespace mmp
