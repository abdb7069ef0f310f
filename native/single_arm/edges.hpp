// Edges and stays of one arm: tests against static bodies, constraints and dynamic obstacles.
#pragma once

#include "geometry/upright_projection.hpp"
#include "proof/segments.hpp"
#include "single_arm/constraints.hpp"
#include "single_arm/dynamic_obstacles.hpp"

namespace mmp {

// Part [lo, hi] of an edge [0, 1] that touches a constraint.
template <class T>
struct BlockedPart {
  int constraint;
  T lo, hi;
};

// Edge of the search: duration at full speed in whole steps, and what it may touch.
template <class V>
struct Edge {
  int steps = 0;
  std::vector<BlockedPart<Scalar<V>>> blocked;
  std::shared_ptr<EdgeTimeline<V>> timeline;  // nullptr: no obstacle ever comes close
};

// Tests edges and stays of one arm against static bodies and a set of constraints.
template <class V>
class EdgeChecker {
 public:
  using T = Scalar<V>;

  EdgeChecker(StaticWorld<V>& world, int arm, std::vector<Constraint<V>*> constraints, Levels<T> levels,
              const T* max_step, DynamicObstacles<V> obstacles = {})
      : prover_(world),
        cell_(world.cell),
        arm_(arm),
        model_(&world.cell->arms[arm]),
        constraints_(std::move(constraints)),
        obstacles_(std::move(obstacles)),
        levels_(levels),
        max_step_(max_step),
        pose_(*model_),
        upright_(*model_) {}

  int steps(const T* from, const T* to) const {
    T n = 0;
    for (int j = 0; j < model_->dof; ++j) n = std::max(n, std::abs(to[j] - from[j]) / max_step_[j]);
    return static_cast<int>(std::min(std::ceil(double(n) - 1e-4), double(kForever)));
  }

  bool is_static_free(const T* from, const T* to) {
    const auto at = [&](int) { return std::pair<const T*, const T*>(from, to); };
    SegmentResult<T> result;
    prover_.alone(arm_, 1, at, levels_, Stop::at_first_contact, &result);
    return result.free;
  }

  // Moves a configuration inside the bound of an upright tool, if there is one. Returns false if that fails.
  bool project(std::vector<T>& q) { return upright_(q.data()); }
  bool is_upright() const { return upright_.is_bound(); }
  // Longest move of a joint in a step of a tree that keeps the tool upright [rad].
  T longest_step() const { return upright_.longest_step(); }

  void evaluate(const T* from, const T* to, Edge<V>& edge) {
    edge.steps = steps(from, to);
    edge.timeline = timeline(from, to, edge.steps);
    edge.blocked.clear();
    if (constraints_.empty()) return;
    const auto at = [&](int) { return std::pair<const T*, const T*>(from, to); };
    T longest = 0;
    for (int j = 0; j < model_->dof; ++j) longest = std::max(longest, std::abs(to[j] - from[j]));
    first_.clear();
    split(first_, 1, model_->dof, at);
    std::vector<std::vector<Piece<T>>> undecided(constraints_.size());
    for (size_t k = 0; k < first_.size(); k += width<V>) {
      const int n = std::min<int>(width<V>, static_cast<int>(first_.size() - k));
      pose(first_.data() + k, n, at);
      for (size_t c = 0; c < constraints_.size(); ++c) {
        auto out = Contacts<V>::of_first(n);
        constraints_[c]->contacts(batch_.middle, batch_.half, pose_, reach_, levels_, out);
        classify(static_cast<int>(c), first_.data() + k, n, out, undecided[c], edge.blocked);
      }
    }
    const T finest = longest > 0 ? std::max(kFinestRad / longest, T(1.0 / 64)) : T(1);
    for (size_t c = 0; c < constraints_.size(); ++c)
      refine(static_cast<int>(c), undecided[c], finest, at, edge.blocked);
    merge(edge.blocked);
  }

  // Returns the edge in the other direction.
  Edge<V> reversed(const T* from, const T* to, const Edge<V>& edge) {
    Edge<V> back{edge.steps, edge.blocked, edge.timeline ? timeline(to, from, edge.steps) : nullptr};
    for (auto& b : back.blocked) b = {b.constraint, T(1) - b.hi, T(1) - b.lo};
    return back;
  }

  // Returns the part [lo, hi] of an edge; what it may touch is known from the whole edge.
  Edge<V> part(const Edge<V>& edge, T lo, T hi, const T* from, const T* to) {
    Edge<V> out;
    out.steps = steps(from, to);
    if (edge.timeline) out.timeline = timeline(from, to, out.steps);
    for (const auto& b : edge.blocked) {
      const T l = std::max(b.lo, lo), h = std::min(b.hi, hi);
      if (l < h) out.blocked.push_back({b.constraint, (l - lo) / (hi - lo), (h - lo) / (hi - lo)});
    }
    return out;
  }

  // Computes the windows in which the arm may not stand at q.
  void standing(const T* q, std::vector<Window>& windows) {
    windows.clear();
    if (!constraints_.empty()) {
      const auto at = [&](int) { return std::pair<const T*, const T*>(q, q); };
      const Piece<T> piece{0, 0, 1};
      pose(&piece, 1, at);
      for (auto* c : constraints_) {
        auto out = Contacts<V>::of_first(1);
        c->contacts(batch_.middle, batch_.half, pose_, reach_, levels_, out);
        if (bits<V>(out.touching | out.undecided) & 1u) windows.push_back(c->window);
      }
    }
    const auto stay = timeline(q, q, 0);
    if (!stay) return;
    for (int k = 0; k <= obstacles_.horizon(); ++k)
      if (!(stay->free_from(k) & 1u))
        windows.push_back({double(k), k < obstacles_.horizon() ? double(k + 1) : double(kForever)});
  }

  const Constraint<V>& constraint(int k) const { return *constraints_[k]; }
  int dof() const { return model_->dof; }
  const ArmModel<T>& model() const { return *model_; }

 private:
  static constexpr T kFinestRad = T(0.03);

  std::shared_ptr<EdgeTimeline<V>> timeline(const T* from, const T* to, int steps) {
    if (obstacles_.empty()) return nullptr;
    const int dof = model_->dof;
    std::vector<T> rows(static_cast<size_t>(steps + 1) * dof);
    for (int s = 0; s <= steps; ++s)
      for (int j = 0; j < dof; ++j)
        rows[static_cast<size_t>(s) * dof + j] = s == 0       ? from[j]
                                                 : s == steps ? to[j]
                                                              : from[j] + T(s) / T(steps) * (to[j] - from[j]);
    return EdgeTimeline<V>::make(obstacles_, Motion<V>(*cell_, arm_, std::move(rows), pose_), pose_);
  }

  template <class At>
  void pose(const Piece<T>* pieces, int n, const At& at) {
    batch_.set(pieces, n, model_->dof, at);
    forward(batch_.middle, pose_);
    sweep_.set(pose_, batch_.middle, batch_.half);
    for (size_t l = 1; l < model_->links.size(); ++l) reach_[l] = sweep_.reach(pose_, static_cast<int>(l));
  }

  // A contact blocks its whole piece. Undecided pieces are tested again.
  static void classify(int c, const Piece<T>* pieces, int n, const Contacts<V>& found, std::vector<Piece<T>>& undecided,
                       std::vector<BlockedPart<T>>& blocked) {
    const unsigned touching = bits<V>(found.touching), undecided_lanes = bits<V>(found.undecided);
    for (int lane = 0; lane < n; ++lane) {
      if (touching >> lane & 1u) blocked.push_back({c, pieces[lane].lo, pieces[lane].hi});
      else if (undecided_lanes >> lane & 1u) undecided.push_back(pieces[lane]);
    }
  }

  template <class At>
  void refine(int c, std::vector<Piece<T>>& stack, T finest, const At& at, std::vector<BlockedPart<T>>& out) {
    while (!stack.empty()) {
      halves_.clear();
      for (const auto& p : stack) {
        if (p.hi - p.lo <= finest) {
          out.push_back({c, p.lo, p.hi});
        } else {
          const T m = (p.lo + p.hi) / 2;
          halves_.push_back({0, p.lo, m});
          halves_.push_back({0, m, p.hi});
        }
      }
      stack.clear();
      for (size_t k = 0; k < halves_.size(); k += width<V>) {
        const int n = std::min<int>(width<V>, static_cast<int>(halves_.size() - k));
        pose(halves_.data() + k, n, at);
        auto found = Contacts<V>::of_first(n);
        constraints_[c]->contacts(batch_.middle, batch_.half, pose_, reach_, levels_, found);
        classify(c, halves_.data() + k, n, found, stack, out);
      }
    }
  }

  static void merge(std::vector<BlockedPart<T>>& blocked) {
    std::sort(blocked.begin(), blocked.end(), [](const auto& a, const auto& b) {
      return a.constraint != b.constraint ? a.constraint < b.constraint : a.lo < b.lo;
    });
    size_t kept = 0;
    for (size_t k = 0; k < blocked.size(); ++k) {
      if (kept > 0 && blocked[k].constraint == blocked[kept - 1].constraint && blocked[k].lo <= blocked[kept - 1].hi)
        blocked[kept - 1].hi = std::max(blocked[kept - 1].hi, blocked[k].hi);
      else blocked[kept++] = blocked[k];
    }
    blocked.resize(kept);
  }

  Prover<V> prover_;
  const CellModel<T>* cell_;
  int arm_;
  const ArmModel<T>* model_;
  std::vector<Constraint<V>*> constraints_;
  DynamicObstacles<V> obstacles_;
  Levels<T> levels_;
  const T* max_step_;
  Pose<V> pose_;
  UprightProjection<V> upright_;
  Sweep<V> sweep_;
  PieceBatch<V> batch_;
  V reach_[kMaxLinks];
  std::vector<Piece<T>> first_, halves_;
};

}  // namespace mmp
