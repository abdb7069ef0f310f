// Self-motions of redundant arms: traces the curves of configurations that all have the tool at one pose.
#pragma once

#include <numbers>

#include "ik/refinement.hpp"

namespace mmp::ik {

using Joints = std::vector<double>;

// Follows curves of a chain that has one joint more than its task has rows. Hinges turn without limits.
class SelfMotion {
 public:
  // lower, upper: limits within which configurations are collected. step: distance of neighbours on a curve, over all
  // joints together [rad or m].
  SelfMotion(const ToolTask& task, const ToolPose& pose, Joints lower, Joints upper, double step)
      : task_(task),
        pose_(pose),
        lower_(std::move(lower)),
        upper_(std::move(upper)),
        step_(step),
        dof_(task.chain.dof()) {}

  // Collects the curve through a configuration with the tool at its pose, unless that curve is known, and those that
  // come near it.
  void add(const Joints& seed) {
    trace(seed);
    while (!pending_.empty()) {
      const Joints next = std::move(pending_.back());
      pending_.pop_back();
      trace(next);
    }
  }

  const std::vector<Joints>& inside() const { return inside_; }

 private:
  static constexpr int kMost = 1500;            // steps of a curve in one direction
  static constexpr double kShortest = 1 / 64.;  // least share of a step
  static constexpr double kAhead = 0.9;         // least cosine of the angle between a step and the curve
  static constexpr double kOnCurve = 0.1;       // largest distance [steps] of a seed from a known curve
  static constexpr int kHalvings = 8;
  static constexpr size_t kBehind = 4;       // links behind a configuration, which it is near in any case
  static constexpr double kSingular = 0.02;  // singular value below which a motion hardly moves the tool
  static constexpr int kRays = 16;           // directions in which curves leave a place where two nearly cross
  static constexpr int kMostCrossings = 64;

  struct Link {
    Joints from, to;
  };

  void trace(const Joints& seed) {
    const Joints direction = tangent(seed, {});
    if (direction.empty() || known(seed, direction)) return;
    collect(seed);
    Joints back(dof_);
    for (int k = 0; k < dof_; ++k) back[k] = -direction[k];
    if (!follow(seed, direction)) follow(seed, back);
  }

  // Follows a curve until it closes, ends, or goes over to a known one at a crossing. Returns whether it closes.
  bool follow(const Joints& seed, Joints direction) {
    Joints at = seed;
    const Joints begin = direction;
    double step = step_;
    for (int count = 0; count < kMost; ++count) {
      Joints next = at;
      for (int k = 0; k < dof_; ++k) next[k] += step * direction[k];
      const bool refined = refine(task_, pose_, settings_, next.data());
      const Joints ahead = refined ? tangent(next, direction) : Joints{};
      if (ahead.empty() || !straight(at, next, direction, step) || dot(direction, ahead) < kAhead) {
        if (step <= kShortest * step_) return false;
        step /= 2;
        --count;
        continue;
      }
      if (count > 2 && closes(at, next, seed, begin)) {
        between(at, nearest_turn(seed, at), 0);
        links_.push_back({at, nearest_turn(seed, at)});
        return true;
      }
      if (out_of_slides(next)) return false;
      if (crossings_ > 0 && known(next, ahead, kBehind)) return false;
      if (clockwise(at, direction) != clockwise(next, ahead)) cross(at, next, direction);
      between(at, next, 0);
      collect(next);
      links_.push_back({at, next});
      at = next, direction = ahead;
      step = std::min(step_, 2 * step);
    }
    return false;
  }

  // Finds where two curves cross, or nearly, between two neighbours on one side of which the joints turn the other way
  // round, and adds configurations of all curves that leave from there. The Jacobian has a second direction there that
  // hardly moves the tool: steps in all directions of that plane lie near all these curves.
  void cross(Joints from, Joints to, const Joints& direction) {
    if (++crossings_ > kMostCrossings) return;
    const bool before = clockwise(from, direction);
    for (int halving = 0; halving < kHalvings; ++halving) {
      Joints middle(dof_);
      for (int k = 0; k < dof_; ++k) middle[k] = (from[k] + to[k]) / 2;
      const Joints ahead = refine(task_, pose_, settings_, middle.data()) ? tangent(middle, direction) : Joints{};
      if (ahead.empty()) break;
      (clockwise(middle, ahead) == before ? from : to) = std::move(middle);
    }
    const Joints first = tangent(from, direction), second = tangent(from, {}, kSingular, first);
    if (second.empty()) return;
    for (int ray = 0; ray < kRays; ++ray) {
      const double angle = 2 * std::numbers::pi * ray / kRays;
      Joints next = from;
      for (int k = 0; k < dof_; ++k) next[k] += step_ * (std::cos(angle) * first[k] + std::sin(angle) * second[k]);
      if (refine(task_, pose_, settings_, next.data())) pending_.push_back(std::move(next));
    }
  }

  // Returns the sign of the determinant of the Jacobian above a direction. It is the same everywhere along a curve, and
  // the other one behind a crossing.
  bool clockwise(const Joints& q, const Joints& direction) const {
    double rows[kMaxDof * kMaxDof];
    task_.slope(ChainFrames(task_.chain, q.data()), rows);
    std::copy(direction.begin(), direction.end(), rows + task_.rows * dof_);
    bool negative = false;
    for (int k = 0; k < dof_; ++k) {
      int pivot = k;
      for (int i = k + 1; i < dof_; ++i)
        if (std::abs(rows[i * dof_ + k]) > std::abs(rows[pivot * dof_ + k])) pivot = i;
      if (pivot != k) {
        std::swap_ranges(rows + k * dof_, rows + k * dof_ + dof_, rows + pivot * dof_);
        negative = !negative;
      }
      if (rows[k * dof_ + k] < 0) negative = !negative;
      if (rows[k * dof_ + k] == 0) return negative;
      for (int i = k + 1; i < dof_; ++i) {
        const double factor = rows[i * dof_ + k] / rows[k * dof_ + k];
        for (int j = k; j < dof_; ++j) rows[i * dof_ + j] -= factor * rows[k * dof_ + j];
      }
    }
    return negative;
  }

  // Returns the unit vector along which the joints move without the tool: towards `along`, if it is given, and at a
  // right angle to `other`. Directions with singular values below `singular` count as not moving the tool.
  Joints tangent(const Joints& q, const Joints& along, double singular = 1e-6, const Joints& other = {}) const {
    const ChainFrames frames(task_.chain, q.data());
    double slope[kMaxRows * kMaxDof];
    task_.slope(frames, slope);
    Joints best;
    double longest = 0.3;
    for (int k = 0; k < (along.empty() ? dof_ : 1); ++k) {
      Joints v = along;
      if (along.empty()) v.assign(dof_, 0), v[k] = 1;
      project(slope, singular, v);
      if (!other.empty()) {
        const double share = dot(v, other);
        for (int j = 0; j < dof_; ++j) v[j] -= share * other[j];
      }
      const double size = std::sqrt(dot(v, v));
      if (size <= longest) continue;
      longest = size, best = v;
      for (double& x : best) x /= size;
    }
    return best;
  }

  // Removes the part of a motion that moves the tool.
  void project(const double* slope, double singular, Joints& v) const {
    const int rows = task_.rows;
    double square[kMaxRows * kMaxRows], moved[kMaxRows];
    for (int i = 0; i < rows; ++i) {
      moved[i] = 0;
      for (int k = 0; k < dof_; ++k) moved[i] += slope[i * dof_ + k] * v[k];
      for (int j = 0; j < rows; ++j) {
        double sum = i == j ? singular * singular : 0.0;
        for (int k = 0; k < dof_; ++k) sum += slope[i * dof_ + k] * slope[j * dof_ + k];
        square[i * rows + j] = sum;
      }
    }
    solve(square, moved, rows);
    for (int k = 0; k < dof_; ++k)
      for (int i = 0; i < rows; ++i) v[k] -= slope[i * dof_ + k] * moved[i];
  }

  bool straight(const Joints& from, const Joints& to, const Joints& direction, double step) const {
    double squared = 0, along = 0;
    for (int k = 0; k < dof_; ++k) {
      squared += (to[k] - from[k]) * (to[k] - from[k]);
      along += (to[k] - from[k]) * direction[k];
    }
    return squared < 1.5 * 1.5 * step * step && along > kAhead * std::sqrt(squared);
  }

  // Returns whether the curve passes its first configuration between two others.
  bool closes(const Joints& from, const Joints& to, const Joints& seed, const Joints& begin) const {
    const Joints first = nearest_turn(seed, from);
    double along = 0;
    for (int k = 0; k < dof_; ++k) along += (to[k] - from[k]) * begin[k];
    return along > 0 && away(first, from, to) < kOnCurve * step_;
  }

  // Returns whether a configuration lies on a known curve of that direction, of which the last links do not count.
  bool known(const Joints& seed, const Joints& direction, size_t but = 0) const {
    for (size_t i = 0; i + but < links_.size(); ++i) {
      const Link& link = links_[i];
      const Joints at = nearest_turn(seed, link.from);
      if (std::abs(at[0] - link.from[0]) > 2 * step_ || away(at, link.from, link.to) > kOnCurve * step_) continue;
      double along = 0, squared = 0;
      for (int k = 0; k < dof_; ++k) {
        along += (link.to[k] - link.from[k]) * direction[k];
        squared += (link.to[k] - link.from[k]) * (link.to[k] - link.from[k]);
      }
      if (std::abs(along) > kAhead * std::sqrt(squared)) return true;
    }
    return false;
  }

  // Returns the distance of a configuration from the straight link between two others.
  double away(const Joints& q, const Joints& from, const Joints& to) const {
    double along = 0, squared = 0, distance = 0;
    for (int k = 0; k < dof_; ++k) {
      along += (q[k] - from[k]) * (to[k] - from[k]);
      squared += (to[k] - from[k]) * (to[k] - from[k]);
    }
    const double share = squared > 0 ? std::clamp(along / squared, 0.0, 1.0) : 0.0;
    for (int k = 0; k < dof_; ++k) {
      const double d = q[k] - from[k] - share * (to[k] - from[k]);
      distance += d * d;
    }
    return std::sqrt(distance);
  }

  // Collects a configuration within the limits between two neighbours outside of them, if the curve enters them there.
  void between(const Joints& from, const Joints& to, int halvings) {
    if (halvings == kHalvings || within(from) || within(to)) return;
    double squared = 0, first = 0, last = 1;
    for (int k = 0; k < dof_; ++k) squared += (to[k] - from[k]) * (to[k] - from[k]);
    for (int k = 0; k < dof_ && first < last; ++k) {
      const double turn = turn_to(k, (from[k] + to[k]) / 2), slope = to[k] - from[k];
      const double low = lower_[k] - squared - turn - from[k], high = upper_[k] + squared - turn - from[k];
      if (std::abs(slope) < 1e-12) {
        if (low > 0 || high < 0) last = first;
        continue;
      }
      first = std::max(first, std::min(low / slope, high / slope));
      last = std::min(last, std::max(low / slope, high / slope));
    }
    if (first >= last) return;
    const double share = (first + last) / 2;
    Joints middle(dof_);
    for (int k = 0; k < dof_; ++k) middle[k] = from[k] + share * (to[k] - from[k]);
    if (!refine(task_, pose_, settings_, middle.data())) return;
    if (collect(middle)) return;
    between(from, middle, halvings + 1);
    between(middle, to, halvings + 1);
  }

  // Returns the turns [rad] that bring a hinge nearest to the middle of its limits.
  double turn_to(int k, double q) const {
    constexpr double kTurn = 2 * std::numbers::pi;
    return task_.chain.slides[k] ? 0 : kTurn * std::nearbyint(((lower_[k] + upper_[k]) / 2 - q) / kTurn);
  }

  bool within(const Joints& q) const {
    for (int k = 0; k < dof_; ++k) {
      const double x = q[k] + turn_to(k, q[k]);
      if (x < lower_[k] || x > upper_[k]) return false;
    }
    return true;
  }

  bool out_of_slides(const Joints& q) const {
    for (int k = 0; k < dof_; ++k) {
      const double room = (upper_[k] - lower_[k]) / 4;
      if (task_.chain.slides[k] && (q[k] < lower_[k] - room || q[k] > upper_[k] + room)) return true;
    }
    return false;
  }

  bool collect(const Joints& q) {
    if (!within(q)) return false;
    inside_.push_back(q);
    return true;
  }

  // Returns `q` with the turns that bring each hinge nearest to another configuration.
  Joints nearest_turn(const Joints& q, const Joints& to) const {
    constexpr double kTurn = 2 * std::numbers::pi;
    Joints out = q;
    for (int k = 0; k < dof_; ++k)
      if (!task_.chain.slides[k]) out[k] += kTurn * std::nearbyint((to[k] - q[k]) / kTurn);
    return out;
  }

  double dot(const Joints& a, const Joints& b) const {
    double sum = 0;
    for (int k = 0; k < dof_; ++k) sum += a[k] * b[k];
    return sum;
  }

  const ToolTask& task_;
  ToolPose pose_;
  Joints lower_, upper_;
  double step_;
  int dof_;
  RefinementSettings settings_{.steps = 6, .farthest = 1};
  std::vector<Link> links_;
  std::vector<Joints> inside_, pending_;
  int crossings_ = 0;
};

}  // namespace mmp::ik
