// Safe intervals of a configuration, and departure times along an edge.
#pragma once

#include <algorithm>
#include <cmath>

#include "single_arm/edges.hpp"

namespace mmp {

// Returns the safe intervals [lo, hi] in whole steps: the complement of the windows in [0, inf). A single step between
// two open windows is useless, but not between forbidden instants.
inline std::vector<std::pair<int, int>> safe_intervals(std::vector<Window> windows) {
  std::sort(windows.begin(), windows.end(), [](const auto& a, const auto& b) { return a.stop() < b.stop(); });
  const bool singles = std::any_of(windows.begin(), windows.end(), [](const auto& w) { return w.is_instant(); });
  std::vector<std::pair<int, int>> out;
  int free_from = 0;
  for (const auto& w : windows) {
    if (w.stop() > free_from || (singles && w.stop() == free_from)) out.emplace_back(free_from, w.stop());
    free_from = std::max(free_from, w.resume());
  }
  if (free_from < kForever) out.emplace_back(free_from, kForever);
  return out;
}

// Returns the earliest whole step, not before `depart`, at which an edge touches no constraint; -1 if there is none.
template <class V>
long clear_of_constraints(const EdgeChecker<V>& checker, const Edge<V>& edge, long depart, long latest) {
  for (bool moved = true; moved && depart <= latest;) {
    moved = false;
    for (const auto& b : edge.blocked) {
      const Window w = checker.constraint(b.constraint).window;
      // Forbidden: from < depart + s * steps < until for some s of the blocked part; at an instant, <= twice.
      const double opens = w.from - double(b.hi) * edge.steps, closes = w.until - double(b.lo) * edge.steps;
      if (w.is_instant()) {
        if (double(depart) < opens || double(depart) > closes) continue;
        depart = static_cast<long>(std::floor(closes)) + 1;
      } else {
        if (double(depart) <= opens || double(depart) >= closes) continue;
        if (w.is_for_ever()) return -1;
        depart = static_cast<long>(std::ceil(closes));
      }
      moved = true;
    }
  }
  return depart <= latest ? depart : -1;
}

// Returns the earliest whole departure along an edge: not before `ready`, no later than `leave_by`, arrival within [lo,
// hi], clear of constraints and dynamic obstacles. -1 if there is none.
template <class V>
int earliest_departure(const EdgeChecker<V>& checker, const Edge<V>& edge, int ready, int leave_by, int lo, int hi) {
  long depart = std::max(ready, lo - edge.steps);
  const long latest = std::min<long>(leave_by, static_cast<long>(hi) - edge.steps);
  while (depart >= 0 && depart <= latest) {
    depart = clear_of_constraints(checker, edge, depart, latest);
    if (depart < 0 || !edge.timeline) return static_cast<int>(depart);
    const long free = edge.timeline->first_free(depart, latest);
    if (free == depart || free < 0) return static_cast<int>(free);
    depart = free;
  }
  return -1;
}

}  // namespace mmp
