// What a branch of the conflict tree forbids one arm, and when. Times are whole steps.
#pragma once

#include <array>
#include <vector>

#include "motion.hpp"

namespace mmp {

inline constexpr int kForever = 1 << 28;

// The arm must not be in the given place at any instant of (from, until).
template <class V>
class Constraint {
 public:
  using T = Scalar<V>;
  int from, until;

  // max_j |q_j - center_j| <= radius.
  static Constraint ball(std::vector<T> center, T radius, int from, int until) {
    Constraint c(from, until);
    c.center_ = std::move(center);
    c.size_ = radius;
    return c;
  }

  // Touching arm `other` as it stands at q, its spheres shrunk by `shrink` [m].
  static Constraint standing(const ArmModel<T>& other, const T* q, T shrink, int from, int until) {
    Constraint c(from, until);
    c.other_.emplace_back(other);
    V joints[kMaxDof];
    for (int j = 0; j < other.dof; ++j) joints[j] = splat<V>(q[j]);
    forward(joints, c.other_[0]);
    for (size_t l = 1; l < other.links.size(); ++l) c.other_[0].detail(static_cast<int>(l));
    c.size_ = shrink;
    return c;
  }

  // Touching another arm as it moves: a part for each step, the arm halfway through it with what it sweeps on the way,
  // and one for where it stops.
  static std::vector<Constraint> moving(const Motion<V>& motion, int from, int until) {
    std::vector<Constraint> parts;
    const auto& arm = *motion.arm;
    std::vector<T> middle(arm.dof);
    for (int k = std::max(from, 0); k < std::min(until, motion.last); ++k) {
      V half[kMaxDof];
      for (int j = 0; j < arm.dof; ++j) {
        const T a = motion.at(k)[j], b = motion.at(k + 1)[j];
        middle[j] = (a + b) / 2;
        half[j] = splat<V>((b - a) / 2);
      }
      parts.push_back(standing(arm, middle.data(), T(0), k, k + 1));
      Sweep<V> sweep;
      sweep.set(parts.back().other_[0], half);
      for (size_t l = 1; l < arm.links.size(); ++l)
        parts.back().sweep_[l] = sweep.reach(parts.back().other_[0], static_cast<int>(l))[0];
    }
    if (until > motion.last)
      parts.push_back(standing(arm, motion.at(motion.last), T(0), std::max(from, motion.last), until));
    return parts;
  }

  // Links from `first_link` on touching a sphere.
  static Constraint ball_in_space(const T* center, T radius, int first_link, int from, int until) {
    Constraint c(from, until);
    c.center_.assign(center, center + 3);
    c.size_ = radius;
    c.first_link_ = first_link;
    return c;
  }

  // `middle`, `half`: the joints in every lane; `reach[l]`: how far link l moves within the lane's piece.
  void contacts(const V* middle, const V* half, Pose<V>& pose, const V* reach, Levels<T> levels, Contacts<V>& out) {
    if (!other_.empty()) {
      auto& other = other_[0];
      // The tip first: it touches most often, and a contact in every lane ends the test.
      for (size_t i = pose.arm->links.size(); i-- > 1;) {
        for (size_t j = other.arm->links.size(); j-- > 1;)
          contact(pose, static_cast<int>(i), other, static_cast<int>(j), levels.margin - size_,
                  reach[i] + (levels.proof - size_ + sweep_[j]), out);
        if (bits<V>(out.hit) == all_bits<V>) return;
      }
    } else if (first_link_ > 0) {
      const Obstacle<T> sphere{
          Shape::sphere, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {center_[0], center_[1], center_[2]}}, size_, 0, 0};
      for (size_t i = static_cast<size_t>(first_link_); i < pose.arm->links.size(); ++i)
        contact(pose, static_cast<int>(i), sphere, levels.margin, reach[i] + levels.proof, out);
    } else {
      Mask<V> inside = V{} < splat<V>(1), near = inside;
      for (size_t j = 0; j < center_.size(); ++j) {
        const V off = abs(middle[j] - center_[j]);
        inside &= off <= splat<V>(size_);
        near &= off <= size_ + abs(half[j]);
      }
      out.hit |= inside;
      out.open |= near;
    }
  }

 private:
  Constraint(int from_step, int until_step) : from(from_step), until(until_step) {}
  std::vector<T> center_;
  std::vector<Pose<V>> other_;        // none or one
  std::array<T, kMaxLinks> sweep_{};  // how far each of its links moves within the window
  T size_{};
  int first_link_ = 0;
};

// Where along an edge a constraint is touched: pieces [lo, hi] of [0, 1].
template <class T>
struct Blocked {
  int constraint;
  T lo, hi;
};

// An edge of the search: whole steps at full speed, and what it may touch on the way.
template <class T>
struct Edge {
  int steps = 0;
  std::vector<Blocked<T>> blocked;
};

// Works out edges and standing configurations of one arm against its static world and a set of constraints.
template <class V>
class EdgeMaker {
 public:
  using T = Scalar<V>;

  EdgeMaker(StaticWorld<V>& world, int arm, std::vector<Constraint<V>*> constraints, Levels<T> levels,
            const T* max_step)
      : prover_(world),
        arm_(arm),
        model_(&world.cell->arms[arm]),
        constraints_(std::move(constraints)),
        levels_(levels),
        max_step_(max_step),
        pose_(*model_) {}

  int steps(const T* from, const T* to) const {
    T n = 0;
    for (int j = 0; j < model_->dof; ++j) n = std::max(n, std::abs(to[j] - from[j]) / max_step_[j]);
    return static_cast<int>(std::min(std::ceil(double(n) - 1e-4), double(kForever)));
  }

  bool statically_free(const T* from, const T* to) {
    const auto at = [&](int) { return std::pair<const T*, const T*>(from, to); };
    SegmentResult<T> result;
    prover_.alone(arm_, 1, at, levels_, Stop::at_first_contact, &result);
    return result.free;
  }

  void touch(const T* from, const T* to, Edge<T>& edge) {
    edge.steps = steps(from, to);
    edge.blocked.clear();
    if (constraints_.empty()) return;
    const auto at = [&](int) { return std::pair<const T*, const T*>(from, to); };
    T longest = 0;
    for (int j = 0; j < model_->dof; ++j) longest = std::max(longest, std::abs(to[j] - from[j]));
    first_.clear();
    cut(first_, 1, model_->dof, at);
    std::vector<std::vector<Piece<T>>> open(constraints_.size());
    for (size_t k = 0; k < first_.size(); k += width<V>) {
      const int n = std::min<int>(width<V>, static_cast<int>(first_.size() - k));
      pose(first_.data() + k, n, at);
      for (size_t c = 0; c < constraints_.size(); ++c) {
        Contacts<V> out;
        constraints_[c]->contacts(batch_.middle, batch_.half, pose_, reach_, levels_, out);
        sort_out(static_cast<int>(c), first_.data() + k, n, out, open[c], edge.blocked);
      }
    }
    const T finest = longest > 0 ? std::max(kFinestRad / longest, T(1.0 / 64)) : T(1);
    for (size_t c = 0; c < constraints_.size(); ++c) refine(static_cast<int>(c), open[c], finest, at, edge.blocked);
    merge(edge.blocked);
  }

  // Windows (from, until) in which the arm may not stand at q.
  void standing(const T* q, std::vector<std::pair<int, int>>& windows) {
    windows.clear();
    if (constraints_.empty()) return;
    const auto at = [&](int) { return std::pair<const T*, const T*>(q, q); };
    const Piece<T> piece{0, 0, 1};
    pose(&piece, 1, at);
    for (auto* c : constraints_) {
      Contacts<V> out;
      c->contacts(batch_.middle, batch_.half, pose_, reach_, levels_, out);
      if (bits<V>(out.hit | out.open) & 1u) windows.emplace_back(c->from, c->until);
    }
  }

  const Constraint<V>& constraint(int k) const { return *constraints_[k]; }
  int dof() const { return model_->dof; }
  const ArmModel<T>& model() const { return *model_; }

 private:
  static constexpr T kFinestRad = T(0.03);

  template <class At>
  void pose(const Piece<T>* pieces, int n, const At& at) {
    batch_.set(pieces, n, model_->dof, at);
    forward(batch_.middle, pose_);
    sweep_.set(pose_, batch_.half);
    for (size_t l = 1; l < model_->links.size(); ++l) reach_[l] = sweep_.reach(pose_, static_cast<int>(l));
  }

  // A contact blocks its whole piece; what is only not proved free is looked at again.
  static void sort_out(int c, const Piece<T>* pieces, int n, const Contacts<V>& found, std::vector<Piece<T>>& open,
                       std::vector<Blocked<T>>& blocked) {
    const unsigned hit = bits<V>(found.hit), near = bits<V>(found.open);
    for (int lane = 0; lane < n; ++lane) {
      if (hit >> lane & 1u) blocked.push_back({c, pieces[lane].lo, pieces[lane].hi});
      else if (near >> lane & 1u) open.push_back(pieces[lane]);
    }
  }

  template <class At>
  void refine(int c, std::vector<Piece<T>>& stack, T finest, const At& at, std::vector<Blocked<T>>& out) {
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
        Contacts<V> found;
        constraints_[c]->contacts(batch_.middle, batch_.half, pose_, reach_, levels_, found);
        sort_out(c, halves_.data() + k, n, found, stack, out);
      }
    }
  }

  static void merge(std::vector<Blocked<T>>& blocked) {
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
  int arm_;
  const ArmModel<T>* model_;
  std::vector<Constraint<V>*> constraints_;
  Levels<T> levels_;
  const T* max_step_;
  Pose<V> pose_;
  Sweep<V> sweep_;
  PieceBatch<V> batch_;
  V reach_[kMaxLinks];
  std::vector<Piece<T>> first_, halves_;
};

// Safe intervals: what the windows leave of [0, inf), as whole steps [lo, hi]; a single instant is no interval.
inline std::vector<std::pair<int, int>> safe_intervals(std::vector<std::pair<int, int>> windows) {
  std::sort(windows.begin(), windows.end());
  std::vector<std::pair<int, int>> out;
  int free_from = 0;
  for (const auto& [from, until] : windows) {
    if (from > free_from) out.emplace_back(free_from, from);
    free_from = std::max(free_from, until);
  }
  if (free_from < kForever) out.emplace_back(free_from, kForever);
  return out;
}

// Earliest whole step at which an edge may be left: not before `ready`, while standing is safe until `leave_by`,
// arriving within [lo, hi], and touching no constraint in its window. -1 if there is none.
template <class V>
int earliest_departure(const EdgeMaker<V>& maker, const Edge<Scalar<V>>& edge, int ready, int leave_by, int lo,
                       int hi) {
  using T = Scalar<V>;
  long depart = std::max(ready, lo - edge.steps);
  const long latest = std::min<long>(leave_by, static_cast<long>(hi) - edge.steps);
  for (bool moved = true; moved && depart <= latest;) {
    moved = false;
    for (const auto& b : edge.blocked) {
      const auto& c = maker.constraint(b.constraint);
      // Forbidden: from < depart + s * steps < until for some s of the blocked piece.
      const T opens = T(c.from) - b.hi * T(edge.steps);
      if (T(depart) <= opens) continue;
      if (c.until >= kForever) return -1;
      const T closes = T(c.until) - b.lo * T(edge.steps);
      if (T(depart) >= closes) continue;
      depart = static_cast<long>(std::ceil(closes));
      moved = true;
    }
  }
  return depart <= latest ? static_cast<int>(depart) : -1;
}

}  // namespace mmp
