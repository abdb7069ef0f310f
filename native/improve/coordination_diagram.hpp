// Pairwise coordination diagrams of two fixed paths (O'Donnell and Lozano-Perez, ICRA 1989).
//
// A state is the number of steps that each arm has done. In each move both arms advance by one step, or one advances
// and the other waits.
#pragma once

#include "geometry/swept_distance.hpp"
#include "runtime/clock.hpp"

namespace mmp {

// Coordination diagram of a pair of paths, tested only where a query comes.
template <class V>
class CoordinationDiagram {
 public:
  using T = Scalar<V>;
  enum Move { both, first, second };  // which arms advance by one step

  CoordinationDiagram(const Motion<V>& a, const Motion<V>& b, Levels<T> levels, T share)
      : a_(&a),
        b_(&b),
        levels_(levels),
        share_(share),
        columns_(static_cast<size_t>(b.last) + 1),
        states_((static_cast<size_t>(a.last) + 1) * columns_, 0) {
    for (int i = static_cast<int>(a.boxes.size()); i-- > 1;)
      for (int j = static_cast<int>(b.boxes.size()); j-- > 1;)
        if (may_be_near(i, j)) near_links_.push_back({i, j});
  }

  // Returns whether both arms can reach their ends from state (s, t): depth-first search. Returns false when the clock
  // ends the search, and then marks nothing.
  bool feasible(int s, int t, const Clock& clock) {
    struct Visit {
      int s, t, move;
      Move by;
    };
    std::vector<Visit> stack{{s, t, both, both}};
    for (int visits = 1; !stack.empty(); ++visits) {
      if (visits % 1024 == 0 && clock.expired()) return false;
      auto& [i, j, move, by] = stack.back();
      auto& flags = at(i, j);
      if (i == a_->last && j == b_->last) flags |= kFeasible;
      Visit next{};
      for (; !(flags & (kFeasible | kDeadEnd)); ++move) {
        if (move > second) {
          flags |= kDeadEnd;
          break;
        }
        if (!free(Move(move), i, j, by)) continue;
        next = {i + (move != second), j + (move != first), both, Move(move)};
        const auto there = at(next.s, next.t);
        if (there & kFeasible) flags |= kFeasible;
        else if (!(there & kDeadEnd)) break;
      }
      if (flags & (kFeasible | kDeadEnd)) stack.pop_back();
      else stack.push_back(next);
    }
    return at(s, t) & kFeasible;
  }

  // Returns whether the move is free and does not lead to a dead end.
  bool may_move(Move move, int s, int t, const Clock& clock) {
    return free(move, s, t, move) && feasible(s + (move != second), t + (move != first), clock);
  }

  size_t states() const { return states_.size(); }

 private:
  // Flags of a state: bits 0 to 2, moves tested; bits 3 to 5, which of these are free; then the verdict.
  static constexpr uint8_t kFeasible = 64, kDeadEnd = 128;

  uint8_t& at(int s, int t) { return states_[static_cast<size_t>(s) * columns_ + t]; }

  bool may_be_near(int i, int j) const {
    const auto &A = a_->arm->links[i], &B = b_->arm->links[j];
    if (A.spheres.count == 0 || B.spheres.count == 0) return false;
    const T reach = std::max(levels_.margin, levels_.proof + share_ * (a_->max_deviation[i] + b_->max_deviation[j]));
    return a_->boxes[i].near(b_->boxes[j], reach + A.bound.r + B.bound.r);
  }

  // Returns whether a move touches nothing. `by` is the move that led here; the next move is likely the same.
  bool free(Move move, int s, int t, Move by) {
    if ((move != second && s == a_->last) || (move != first && t == b_->last)) return false;
    const auto& flags = at(s, t);
    if (!(flags >> move & 1u)) {
      if (move == first) test_moves<first, first>(s, t);
      else if (move == second) test_moves<second, second>(s, t);
      else if (by == first) test_moves<both, first>(s, t);
      else if (by == second) test_moves<both, second>(s, t);
      else test_moves<both, both>(s, t);
    }
    return flags >> (3 + move) & 1u;
  }

  // Tests a move from this state and from the next ones in direction `along`, one state per lane.
  template <Move move, Move along>
  void test_moves(int s, int t) {
    int count = width<V>;
    if (along != second) count = std::min(count, a_->last - s);
    if (along != first) count = std::min(count, b_->last - t);
    unsigned clear = (2u << (count - 1)) - 1, blocked = 0;  // so far
    using OfA = Side<move != second, along != second>;
    using OfB = Side<move != first, along != first>;
    for (size_t n = 0; n < near_links_.size() && !(blocked & 1u); ++n) {
      const auto [i, j] = near_links_[n];
      const V deviation = OfA::deviation(*a_, i, s) + OfB::deviation(*b_, j, t);
      const V far = max(levels_.proof + share_ * deviation, splat<V>(levels_.margin));
      if (exact(*a_->arm, i, *b_->arm, j)) {
        // Hulls are tested one lane at a time, so only up to the first contact: the search seldom goes beyond it.
        const unsigned touching = hulls_touching<OfA, OfB>(i, s, j, t, far, clear);
        blocked |= touching;
        clear &= lanes_before_first(touching);
      } else {
        blocked |= links_near<V>(
            *a_->arm, i, [&](auto array, int e) { return OfA::chord(*a_, a_->*array, e, s); }, *b_->arm, j,
            [&](auto array, int e) { return OfB::chord(*b_, b_->*array, e, t); }, far, clear);
        clear &= ~blocked;
      }
      if (blocked & 1u) std::rotate(near_links_.begin(), near_links_.begin() + n, near_links_.begin() + n + 1);
    }
    // A contact at the first state ends the test early: then only the contacts of the other lanes are known.
    const unsigned known = blocked & 1u ? blocked : blocked | clear;
    for (int k = 0; k < count; ++k) {
      if (!(known >> k & 1u)) continue;
      auto& flags = at(along == second ? s : s + k, along == first ? t : t + k);
      flags |= 1u << move | (blocked >> k & 1u ? 0u : 8u << move);
    }
  }

  // Returns the lanes of `asked` in which the hulls of two links come closer than `far`.
  template <class OfA, class OfB>
  MMP_NOINLINE unsigned hulls_touching(int i, int s, int j, int t, const V& far, unsigned asked) const {
    return hulls_near<V>(
        *a_->arm, i, [&](auto array, int e) { return OfA::chord(*a_, a_->*array, e, s); }, *b_->arm, j,
        [&](auto array, int e) { return OfB::chord(*b_, b_->*array, e, t); }, far, asked,
        [&](int lane) {
          return StepEnds{OfA::hulls(*a_, i, s, lane, 0), OfA::hulls(*a_, i, s, lane, 1),
                          OfB::hulls(*b_, j, t, lane, 0), OfB::hulls(*b_, j, t, lane, 1)};
        },
        true);
  }

  // One arm as a test sees it: moving or standing, at a later step in each lane or at the same one.
  template <bool moves, bool lanes>
  struct Side {
    static MMP_INLINE Chord<V> chord(const Motion<V>& m, const Unfilled<T>& array, int e, int k) {
      if constexpr (moves) return lanes ? m.chord(array, e, k) : m.chord_at(array, e, k);
      else return {lanes ? m.centers(array, e, k) : m.chord_at(array, e, k).from, {V{}, V{}, V{}}};
    }
    static PosedHulls hulls(const Motion<V>& m, int l, int k, int lane, int end) {
      return m.hulls_at(l, k + (lanes ? lane : 0) + (moves ? end : 0));
    }
    static V deviation(const Motion<V>& m, int l, int k) {
      if constexpr (!moves) return V{};
      else return lanes ? m.deviation_at(l, k) : splat<V>(m.deviation[static_cast<size_t>(l) * m.stride + k]);
    }
  };

  const Motion<V>*a_, *b_;
  Levels<T> levels_;
  T share_;
  size_t columns_;
  std::vector<uint8_t> states_;
  std::vector<std::pair<int, int>> near_links_;  // links that ever come close, the last contact first
};

}  // namespace mmp
