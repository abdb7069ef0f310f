// Constraints of the conflict tree: what is forbidden for one arm, and when. Times are in steps.
#pragma once

#include <array>
#include <vector>

#include "geometry/collision.hpp"
#include "geometry/motion.hpp"

namespace mmp {

// Open interval (from, until) of time; one instant where both are equal.
struct Window {
  double from, until;

  bool is_instant() const { return from == until; }
  bool is_for_ever() const { return until >= kForever; }
  // Last whole step of a stay before the window, and first one after it.
  int stop() const { return static_cast<int>(is_instant() ? std::ceil(from) - 1 : std::floor(from)); }
  int resume() const { return static_cast<int>(is_instant() ? std::floor(until) + 1 : std::ceil(until)); }

  // Returns the quarter-steps strictly inside, up to one step after the end of a motion; or the instant.
  std::vector<double> instants(int last) const {
    if (is_instant()) return from >= 0 ? std::vector<double>{from} : std::vector<double>{};
    std::vector<double> out;
    const double end = std::min(until, std::max(double(last), std::ceil(from)) + 1);
    for (double h = std::max(0.0, std::floor(4 * from) + 1); h < 4 * end; ++h) out.push_back(h / 4);
    if (out.empty() && until > 0) out.push_back((std::max(from, 0.0) + until) / 2);
    return out;
  }
};

// Region that the arm must avoid during the window.
template <class V>
class Constraint {
 public:
  using T = Scalar<V>;
  Window window;

  // max_j |q_j - center_j| <= radius.
  static Constraint ball(std::vector<T> center, T radius, Window window) {
    Constraint c(window);
    c.center_ = std::move(center);
    c.size_ = radius;
    return c;
  }

  // Contact with arm `other` standing at q, its spheres smaller by `shrink` [m].
  static Constraint standing(const ArmModel<T>& other, const T* q, T shrink, Window window) {
    Constraint c(window);
    c.other_.emplace_back(other);
    V joints[kMaxDof];
    for (int j = 0; j < other.dof; ++j) joints[j] = splat<V>(q[j]);
    forward(joints, c.other_[0]);
    for (size_t l = 1; l < other.links.size(); ++l) c.other_[0].detail(static_cast<int>(l));
    c.size_ = shrink;
    c.enclose();
    return c;
  }

  // Contact with a moving arm: one part per step, the arm halfway through the step with the volume that it sweeps, and
  // one part for its final position.
  static std::vector<Constraint> moving(const Motion<V>& motion, int from, int until) {
    std::vector<Constraint> parts;
    const auto& arm = *motion.arm;
    std::vector<T> middle(arm.dof);
    for (int k = std::max(from, 0); k < std::min(until, motion.last); ++k) {
      V at_middle[kMaxDof], half[kMaxDof];
      for (int j = 0; j < arm.dof; ++j) {
        const T a = motion.at(k)[j], b = motion.at(k + 1)[j];
        middle[j] = (a + b) / 2;
        at_middle[j] = splat<V>(middle[j]);
        half[j] = splat<V>((b - a) / 2);
      }
      parts.push_back(standing(arm, middle.data(), T(0), {double(k), double(k + 1)}));
      Sweep<V> sweep;
      sweep.set(parts.back().other_[0], at_middle, half);
      for (size_t l = 1; l < arm.links.size(); ++l)
        parts.back().sweep_[l] = sweep.reach(parts.back().other_[0], static_cast<int>(l))[0];
      parts.back().enclose();
    }
    const Window rest{double(std::max(from, motion.last)), double(until)};
    if (rest.from < rest.until) parts.push_back(standing(arm, motion.at(motion.last), T(0), rest));
    return parts;
  }

  // Contact of links from `first_link` on with a sphere.
  static Constraint ball_in_space(const T* center, T radius, int first_link, Window window) {
    Constraint c(window);
    c.center_.assign(center, center + 3);
    c.size_ = radius;
    c.first_link_ = first_link;
    return c;
  }

  // Number of joints of the constrained configuration; 0 for regions in space.
  int joints() const { return other_.empty() && first_link_ == 0 ? static_cast<int>(center_.size()) : 0; }

  // `middle`, `half`: joints in every lane. `reach[l]`: how far link l moves within the lane's piece.
  void contacts(const V* middle, const V* half, Pose<V>& pose, const V* reach, Levels<T> levels, Contacts<V>& out) {
    if (!other_.empty()) {
      auto& other = other_[0];
      // The tip first: it touches most often, and a contact in every lane ends the test.
      for (size_t i = pose.arm->links.size(); i-- > 1;) {
        const V far = max(reach[i] + (levels.proof - size_), splat<V>(levels.margin - size_));
        if (!box_.near(pose.link[i], far + (pose.arm->links[i].bound.r + kRounding))) continue;
        for (size_t j = other.arm->links.size(); j-- > 1;)
          contact(pose, static_cast<int>(i), other, static_cast<int>(j), levels.margin - size_,
                  reach[i] + (levels.proof - size_ + sweep_[j]), out);
        if (bits<V>(out.touching) == all_bits<V>) return;
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
      out.touching |= inside;
      out.undecided |= near;
    }
  }

 private:
  static constexpr T kRounding = T(1e-5);  // [m]; the box must never exclude what links would find

  explicit Constraint(Window when) : window(when) {}

  // Puts the box around the links of the other arm and what they sweep.
  void enclose() {
    box_ = {};
    for (size_t l = 1; l < other_[0].arm->links.size(); ++l)
      box_.include(other_[0].link[l], other_[0].arm->links[l].bound.r + sweep_[l]);
  }

  std::vector<T> center_;
  std::vector<Pose<V>> other_;        // none or one
  std::array<T, kMaxLinks> sweep_{};  // how far each of its links moves within the window
  Box<T> box_;                        // around them
  T size_{};
  int first_link_ = 0;
};

// Returns whether a motion comes closer than `margin` [m] to a forbidden region at a quarter of a step of its window,
// or at its instant.
template <class V>
bool breaks(const Motion<V>& m, const std::vector<Constraint<V>*>& constraints, Scalar<V> margin) {
  using T = Scalar<V>;
  Pose<V> pose(*m.arm);
  V q[kMaxDof], none[kMaxDof]{}, reach[kMaxLinks]{};
  for (auto* c : constraints) {
    const auto instants = c->window.instants(m.last);
    for (size_t first = 0; first < instants.size(); first += width<V>) {
      for (int lane = 0; lane < width<V>; ++lane) {
        const double t = instants[std::min(first + lane, instants.size() - 1)];
        const int k = static_cast<int>(std::min(t, double(m.last)));
        const T f = T(std::min(t - k, 1.0));
        const T *lo = m.at(k), *hi = m.at(k + 1);
        for (int j = 0; j < m.arm->dof; ++j) q[j][lane] = lo[j] + f * (hi[j] - lo[j]);
      }
      forward(q, pose);
      const int count = static_cast<int>(std::min<size_t>(width<V>, instants.size() - first));
      auto out = Contacts<V>::of_first(count);
      c->contacts(q, none, pose, reach, {margin, margin}, out);
      if (bits<V>(out.touching) & first_lanes<V>(count)) return true;
    }
  }
  return false;
}

}  // namespace mmp
