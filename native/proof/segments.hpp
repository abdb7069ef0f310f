// Proofs that straight joint-space segments are free at every instant.
//
// A segment is split into pieces. A piece is proved when, at its middle, every pair of surfaces is farther apart than
// `proof` plus the distance that both can move within the piece. It is a contact when some pair is closer than
// `margin`. The bound of an upright tool is tested like a pair. Otherwise it is halved. With `margin` > `proof` this
// ends soon; a piece that is undecided at the finest size counts as contact. The pieces do not depend on the number of
// lanes, so the answers do not either.
#pragma once

#include <array>
#include <vector>

#include "geometry/static_world.hpp"
#include "geometry/upright.hpp"
#include "runtime/clock.hpp"

namespace mmp {

template <class T>
struct Piece {
  int segment;
  T lo, hi;
};

template <class T>
struct SegmentResult {
  bool free = true;
  T contact = T(2);  // earliest contact found, along the segment [0, 1]
};

inline constexpr int kFirstPieces = 8;
inline constexpr int kMaxPieces = 4096;
template <class T>
inline constexpr T kFirstPieceRad = T(0.12);
template <class T>
inline constexpr T kFinestPiece = T(1.0 / 16384);
template <class T>
inline constexpr T kLocated = T(1.0 / 32);  // a contact is located no more precisely than this

enum class Stop { at_first_contact, at_first_contact_of_segment, when_located };

// Half widths and middles of up to `width` pieces, one per lane. Idle lanes repeat the last piece.
template <class V>
struct PieceBatch {
  V middle[kMaxDof], half[kMaxDof];

  template <class At>  // At(segment) -> pair of pointers to q_from and q_to
  void set(const Piece<Scalar<V>>* pieces, int count, int dof, const At& at) {
    for (int lane = 0; lane < width<V>; ++lane) {
      const auto& piece = pieces[lane < count ? lane : count - 1];
      const auto [from, to] = at(piece.segment);
      const auto m = (piece.lo + piece.hi) / 2, h = (piece.hi - piece.lo) / 2;
      for (int j = 0; j < dof; ++j) {
        middle[j][lane] = from[j] + m * (to[j] - from[j]);
        half[j][lane] = h * (to[j] - from[j]);
      }
    }
  }
};

// Piece scheduler of all proofs. `test(pieces, count, out)` fills the contacts of up to `width` pieces.
template <class V, class Test>
void prove_pieces(std::vector<Piece<Scalar<V>>>& stack, SegmentResult<Scalar<V>>* results, Stop stop,
                  const Clock* clock, const Test& test) {
  using T = Scalar<V>;
  std::array<Piece<T>, width<V>> batch;
  while (!stack.empty()) {
    int count = 0;
    while (!stack.empty() && count < width<V>) {
      const auto piece = stack.back();
      stack.pop_back();
      // Skips pieces behind a known contact.
      if (piece.lo < results[piece.segment].contact) batch[count++] = piece;
    }
    if (count == 0) break;
    if (clock && clock->expired()) {
      for (int k = 0; k < count; ++k) results[batch[k].segment].free = false;
      return;
    }
    auto found = Contacts<V>::of_first(count);
    test(batch.data(), count, found);
    const unsigned touching = bits<V>(found.touching), undecided = bits<V>(found.undecided);
    for (int lane = count - 1; lane >= 0; --lane) {
      const auto& piece = batch[lane];
      const T middle = (piece.lo + piece.hi) / 2;
      auto& result = results[piece.segment];
      const bool contact = touching >> lane & 1u;
      if (contact || ((undecided >> lane & 1u) && piece.hi - piece.lo <= kFinestPiece<T>)) {
        result.free = false;
        result.contact = stop == Stop::at_first_contact_of_segment ? T(-1) : std::min(result.contact, middle);
        if (stop == Stop::at_first_contact) return;
        if (contact && piece.hi - piece.lo > kLocated<T>) stack.push_back({piece.segment, piece.lo, middle});
      } else if (undecided >> lane & 1u) {
        stack.push_back({piece.segment, middle, piece.hi});
        stack.push_back({piece.segment, piece.lo, middle});
      }
    }
  }
}

// Returns the largest joint move along a segment.
template <class T>
T longest_move(std::pair<const T*, const T*> ends, int dof) {
  T longest = 0;
  for (int j = 0; j < dof; ++j) longest = std::max(longest, std::abs(ends.second[j] - ends.first[j]));
  return longest;
}

// Pushes the pieces of the segments that are `wanted`, the first one last.
template <class T, class At, class Wanted>
void split(std::vector<Piece<T>>& stack, int segments, int dof, const At& at, const Wanted& wanted) {
  for (int s = segments - 1; s >= 0; --s) {
    if (!wanted(s)) continue;
    const T longest = longest_move(at(s), dof);
    int pieces = static_cast<int>(std::min(std::ceil(longest / kFirstPieceRad<T>), T(kMaxPieces)));
    if (segments == 1) pieces = (pieces + kFirstPieces - 1) / kFirstPieces * kFirstPieces;
    pieces = std::clamp(pieces, 1, kMaxPieces);
    for (int k = pieces - 1; k >= 0; --k) stack.push_back({s, T(k) / T(pieces), T(k + 1) / T(pieces)});
  }
}

template <class T, class At>
void split(std::vector<Piece<T>>& stack, int segments, int dof, const At& at) {
  split(stack, segments, dof, at, [](int) { return true; });
}

// Proofs about one arm alone and about two arms that move at the same time.
template <class V>
class Prover {
 public:
  using T = Scalar<V>;
  explicit Prover(StaticWorld<V>& world) : world_(&world) {}
  Prover(Prover&&) = default;  // not copyable, so that owners cannot be copied by the bindings

  // `at(s)` returns the ends of segment s of arm a.
  template <class At>
  void alone(int a, int segments, const At& at, Levels<T> levels, Stop stop, SegmentResult<T>* results,
             const Clock* clock = nullptr) {
    const auto& arm = world_->cell->arms[a];
    Pose<V>& pose = pose_of(a);
    Sweep<V> sweep;
    PieceBatch<V> batch;
    stack_.clear();
    split(stack_, segments, arm.dof, at);
    prove_pieces<V>(stack_, results, stop, clock, [&](const Piece<T>* p, int n, Contacts<V>& out) {
      batch.set(p, n, arm.dof, at);
      forward(batch.middle, pose);
      sweep.set(pose, batch.middle, batch.half);
      const auto reach = [&](int l) { return sweep.reach(pose, l) + levels.proof; };
      const auto reach_self = [&](int k) {
        return sweep.reach_relative(pose, arm.self_pairs[k].first, arm.self_pairs[k].second) + levels.proof;
      };
      const auto done = [&](const Contacts<V>& c) {
        return stop == Stop::at_first_contact && (bits<V>(c.touching) & first_lanes<V>(n));
      };
      if (arm.upright) {
        test_upright(pose, sweep, levels, out);
        if (done(out)) return;
      }
      world_->contacts(a, pose, levels, reach, reach_self, done, out);
    });
  }

  // `bases` also tests moving links against the other arm's base.
  template <class AtA, class AtB>
  void pair(int a, int b, int segments, const AtA& at_a, const AtB& at_b, Levels<T> levels, bool bases,
            SegmentResult<T>* results, const Clock* clock = nullptr) {
    const auto &arm_a = world_->cell->arms[a], &arm_b = world_->cell->arms[b];
    Pose<V>&pose_a = pose_of(a), &pose_b = pose_of(b);
    Sweep<V> sweep_a, sweep_b;
    PieceBatch<V> batch_a, batch_b;
    stack_.clear();
    for (int s = segments - 1; s >= 0; --s) {
      const T longest = std::max(longest_move(at_a(s), arm_a.dof), longest_move(at_b(s), arm_b.dof));
      const int pieces =
          std::clamp(static_cast<int>(std::min(longest / kFirstPieceRad<T>, T(kMaxPieces))), 1, kMaxPieces);
      for (int k = pieces - 1; k >= 0; --k) stack_.push_back({s, T(k) / T(pieces), T(k + 1) / T(pieces)});
    }
    prove_pieces<V>(stack_, results, Stop::when_located, clock, [&](const Piece<T>* p, int n, Contacts<V>& out) {
      batch_a.set(p, n, arm_a.dof, at_a);
      batch_b.set(p, n, arm_b.dof, at_b);
      forward(batch_a.middle, pose_a);
      forward(batch_b.middle, pose_b);
      sweep_a.set(pose_a, batch_a.middle, batch_a.half);
      sweep_b.set(pose_b, batch_b.middle, batch_b.half);
      const size_t first = bases ? 0 : 1;
      V reach_b[kMaxLinks]{};
      for (size_t j = 1; j < arm_b.links.size(); ++j) reach_b[j] = sweep_b.reach(pose_b, static_cast<int>(j));
      for (size_t i = first; i < arm_a.links.size(); ++i) {
        const V reach = (i == 0 ? V{} : sweep_a.reach(pose_a, static_cast<int>(i))) + levels.proof;
        for (size_t j = i == 0 ? 1 : first; j < arm_b.links.size(); ++j)
          contact(pose_a, static_cast<int>(i), pose_b, static_cast<int>(j), levels.margin, reach + reach_b[j], out);
      }
    });
  }

  StaticWorld<V>& world() { return *world_; }

 private:
  // Poses are kept because their arrays are large.
  Pose<V>& pose_of(int a) {
    if (poses_.empty()) poses_.resize(world_->cell->arms.size());
    if (!poses_[a]) poses_[a] = std::make_unique<Pose<V>>(world_->cell->arms[a]);
    return *poses_[a];
  }

  StaticWorld<V>* world_;
  std::vector<std::unique_ptr<Pose<V>>> poses_;  // per arm
  std::vector<Piece<T>> stack_;
};

}  // namespace mmp
