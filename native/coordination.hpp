// Two arms on ways that stay as they are: when each may go on, and whether both can come to their ends.
//
// Coordination diagrams (O'Donnell and Lozano-Perez, ICRA 1989): a place is how many steps each of the two has done.
// From a place both go on by a step, or one of them while the other waits.
#pragma once

#include "chords.hpp"
#include "clock.hpp"
#include "cuts.hpp"

namespace mmp {

// A way of one arm in as few steps as full speed allows, without waiting.
template <class V>
struct Track {
  using T = Scalar<V>;

  Motion<V> motion;
  int number;         // a name for it
  double length = 0;  // [rad]

  // rows: [n][dof]
  Track(const CellModel<T>& cell, int a, const std::vector<T>& rows, const Pace<T>& pace, int number)
      : motion(cell, a, merged(rows, pace)), number(number) {
    for (int k = 0; k < motion.last; ++k) length += apart(motion.at(k), motion.at(k + 1), motion.arm->dof);
  }

 private:
  static constexpr T kStraight = T(1e-4);  // [rad]

  // Rows that go straight on become one step where full speed allows.
  static std::vector<T> merged(const std::vector<T>& rows, const Pace<T>& pace) {
    const int dof = pace.dof(), count = static_cast<int>(rows.size()) / dof;
    const auto row = [&](int k) { return rows.data() + static_cast<size_t>(k) * dof; };
    std::vector<T> out(row(0), row(1));
    int from = 0, to = 0;  // of the step that may still become longer
    const auto close = [&] {
      if (to > from) out.insert(out.end(), row(to), row(to) + dof);
      from = to;
    };
    for (int k = 1; k < count; ++k) {
      if (longest_move<T>({row(to), row(k)}, dof) <= kStraight && k + 1 < count) continue;
      bool straight = pace.steps(row(from), row(k)) <= 1;
      for (int via = from + 1; straight && via < k; ++via) straight = on_the_way(row(from), row(via), row(k), dof);
      if (to > from && !straight) close();
      to = k;
    }
    close();
    return out;
  }

  static bool on_the_way(const T* p, const T* via, const T* q, int dof) {
    T whole = 0, part = 0;
    for (int j = 0; j < dof; ++j) {
      whole += (q[j] - p[j]) * (q[j] - p[j]);
      part += (via[j] - p[j]) * (q[j] - p[j]);
    }
    const T f = whole > 0 ? std::clamp(part / whole, T(0), T(1)) : T(0);
    for (int j = 0; j < dof; ++j)
      if (std::abs(p[j] + f * (q[j] - p[j]) - via[j]) > kStraight) return false;
    return true;
  }
};

// The diagram of a pair, looked at only where somebody asks.
template <class V>
class Diagram {
 public:
  using T = Scalar<V>;
  enum Move { both, first, second };  // who goes on by a step

  Diagram(const Motion<V>& a, const Motion<V>& b, Levels<T> levels, T share)
      : a_(&a),
        b_(&b),
        levels_(levels),
        share_(share),
        columns_(static_cast<size_t>(b.last) + 1),
        places_((static_cast<size_t>(a.last) + 1) * columns_, 0) {
    for (int i = static_cast<int>(a.boxes.size()); i-- > 1;)
      for (int j = static_cast<int>(b.boxes.size()); j-- > 1;)
        if (may_meet(i, j)) meeting_.push_back({i, j});
  }

  // Whether both can come to their ends from where the first has done s steps and the second t: depth first. Not if
  // the clock ends it, which leaves it open.
  bool open(int s, int t, const Clock& clock) {
    struct Visit {
      int s, t, move;
      Move by;
    };
    std::vector<Visit> stack{{s, t, both, both}};
    for (int visits = 1; !stack.empty(); ++visits) {
      if (visits % 1024 == 0 && clock.expired()) return false;
      auto& [i, j, move, by] = stack.back();
      auto& place = at(i, j);
      if (i == a_->last && j == b_->last) place |= kOpen;
      Visit next{};
      for (; !(place & (kOpen | kShut)); ++move) {
        if (move > second) {
          place |= kShut;
          break;
        }
        if (!free(Move(move), i, j, by)) continue;
        next = {i + (move != second), j + (move != first), both, Move(move)};
        const auto there = at(next.s, next.t);
        if (there & kOpen) place |= kOpen;
        else if (!(there & kShut)) break;
      }
      if (place & (kOpen | kShut)) stack.pop_back();
      else stack.push_back(next);
    }
    return at(s, t) & kOpen;
  }

  // Whether they may go on like that from there without shutting themselves in.
  bool may(Move move, int s, int t, const Clock& clock) {
    return free(move, s, t, move) && open(s + (move != second), t + (move != first), clock);
  }

  size_t places() const { return places_.size(); }

 private:
  // Of a place: bits 0 to 2, which moves were looked at; 3 to 5, which of these are free; and what comes of it.
  static constexpr uint8_t kOpen = 64, kShut = 128;

  uint8_t& at(int s, int t) { return places_[static_cast<size_t>(s) * columns_ + t]; }

  bool may_meet(int i, int j) const {
    const auto &A = a_->arm->links[i], &B = b_->arm->links[j];
    if (A.spheres.count == 0 || B.spheres.count == 0) return false;
    const T reach = std::max(levels_.margin, levels_.proof + share_ * (a_->most_bulge[i] + b_->most_bulge[j]));
    return a_->boxes[i].near(b_->boxes[j], reach + A.bound.r + B.bound.r);
  }

  // Whether nothing touches on the way of a move. The move `by` which they came here is the likely one from here on.
  bool free(Move move, int s, int t, Move by) {
    if ((move != second && s == a_->last) || (move != first && t == b_->last)) return false;
    const auto& place = at(s, t);
    if (!(place >> move & 1u)) {
      if (move == first) look<first, first>(s, t);
      else if (move == second) look<second, second>(s, t);
      else if (by == first) look<both, first>(s, t);
      else if (by == second) look<both, second>(s, t);
      else look<both, both>(s, t);
    }
    return place >> (3 + move) & 1u;
  }

  // Looks at a move from here and from the places that going `along` leads to, one a lane.
  template <Move move, Move along>
  void look(int s, int t) {
    int count = width<V>;
    if (along != second) count = std::min(count, a_->last - s);
    if (along != first) count = std::min(count, b_->last - t);
    const unsigned asked = (2u << (count - 1)) - 1;
    using OfA = Side<move != second, along != second>;
    using OfB = Side<move != first, along != first>;
    unsigned hit = 0;
    for (size_t n = 0; n < meeting_.size() && !(hit & 1u); ++n) {
      const auto [i, j] = meeting_[n];
      const V bulge = OfA::bulge(*a_, i, s) + OfB::bulge(*b_, j, t);
      const V far = max(levels_.proof + share_ * bulge, splat<V>(levels_.margin));
      hit |= links_near<V>(
          *a_->arm, i, [&](auto array, int e) { return OfA::chord(*a_, a_->*array, e, s); }, *b_->arm, j,
          [&](auto array, int e) { return OfB::chord(*b_, b_->*array, e, t); }, far, asked & ~hit);
      if (hit & 1u) std::rotate(meeting_.begin(), meeting_.begin() + n, meeting_.begin() + n + 1);
    }
    // Once this very place is not free nobody looks on: of the other lanes just the contacts are known.
    const unsigned known = hit & 1u ? hit : asked;
    for (int k = 0; k < count; ++k) {
      if (!(known >> k & 1u)) continue;
      auto& place = at(along == second ? s : s + k, along == first ? t : t + k);
      place |= 1u << move | (hit >> k & 1u ? 0u : 8u << move);
    }
  }

  // What a look sees of one of the arms: it moves or stands, at a step further on in each lane or at the same one.
  template <bool moves, bool lanes>
  struct Side {
    static MMP_INLINE Chord<V> chord(const Motion<V>& m, const Unfilled<T>& array, int e, int k) {
      if constexpr (moves) return lanes ? m.chord(array, e, k) : m.chord_at(array, e, k);
      else return {lanes ? m.centers(array, e, k) : m.chord_at(array, e, k).from, {V{}, V{}, V{}}};
    }
    static V bulge(const Motion<V>& m, int l, int k) {
      if constexpr (!moves) return V{};
      else return lanes ? m.bulge_at(l, k) : splat<V>(m.bulge[static_cast<size_t>(l) * m.stride + k]);
    }
  };

  const Motion<V>*a_, *b_;
  Levels<T> levels_;
  T share_;
  size_t columns_;
  std::vector<uint8_t> places_;
  std::vector<std::pair<int, int>> meeting_;  // links that ever come near each other, those that touched last first
};

}  // namespace mmp
