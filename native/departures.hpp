// When an arm may stand somewhere, and when it may leave along an edge.
#pragma once

#include <algorithm>
#include <cmath>

#include "edges.hpp"

namespace mmp {

// Safe intervals: what the windows leave of [0, inf), as whole steps [lo, hi]. Between two open windows a single step
// is of no use; where instants are forbidden it may be all there is.
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

// Earliest whole step at which an edge may be left with regard to constraints, `depart` or later; -1: never.
template <class V>
long clear_of_constraints(const EdgeMaker<V>& maker, const Edge<V>& edge, long depart, long latest) {
  for (bool moved = true; moved && depart <= latest;) {
    moved = false;
    for (const auto& b : edge.blocked) {
      const Window w = maker.constraint(b.constraint).window;
      // Forbidden: from < depart + s * steps < until for some s of the blocked piece; at an instant, <= twice.
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

// Earliest whole step at which an edge may be left: not before `ready`, while standing is safe until `leave_by`,
// arriving within [lo, hi], and touching no constraint in its window and no mover. -1 if there is none.
template <class V>
int earliest_departure(const EdgeMaker<V>& maker, const Edge<V>& edge, int ready, int leave_by, int lo, int hi) {
  long depart = std::max(ready, lo - edge.steps);
  const long latest = std::min<long>(leave_by, static_cast<long>(hi) - edge.steps);
  while (depart >= 0 && depart <= latest) {
    depart = clear_of_constraints(maker, edge, depart, latest);
    if (depart < 0 || !edge.passage) return static_cast<int>(depart);
    const long free = edge.passage->first_free(depart, latest);
    if (free == depart || free < 0) return static_cast<int>(free);
    depart = free;
  }
  return -1;
}

}  // namespace mmp
