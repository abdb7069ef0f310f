// Repulsive trajectory modification: the force field of APF-ECBS and its gradient descent (ModifyMotion).
#pragma once

#include <memory>

#include "constraints.hpp"
#include "pair_check.hpp"

namespace mmp {

struct RepulsionOptions {
  double alpha = 1e-7, k_rep = 0.05, d0 = 0.10;
  int max_iterations = 50;
  bool centre_distance = false;  // the paper's letter: distances between centres, not surfaces
  bool normalised = false;       // fixed largest step, forces smoothed over time
  double normalised_step = 0.02;
  double max_step = 0.05;  // cap per joint and iteration [rad]
  double comfort = 0.02;   // early stop once this clearance is reached [m]; negative: run all iterations
};

inline constexpr double kDistanceFloor = 0.01;  // [m], where the force stops growing

template <class V>
class Repulsion {
 public:
  using T = Scalar<V>;
  Repulsion(StaticWorld<V>& world, const RepulsionOptions& options)
      : options_(options), prover_(world), pairs_(world) {}

  // Joint forces J^T F on every inner step of `motion`, [last + 1][dof], zero at the ends.
  void force(const Motion<V>& motion, const std::vector<const Motion<V>*>& others, std::vector<T>& out) {
    const int dof = motion.arm->dof;
    out.assign(static_cast<size_t>(motion.last + 1) * dof, T(0));
    Pose<V> pose(*motion.arm);
    for (int k = 0; k <= motion.last; k += width<V>) {
      Vec3<V> push[kMaxDof + 1], moment[kMaxDof + 1];
      for (int f = 0; f <= dof; ++f) push[f] = moment[f] = {V{}, V{}, V{}};
      bool any = false;
      for (const auto* other : others) any |= push_from(motion, *other, k, push, moment);
      if (any) transpose_jacobian(motion, pose, k, push, moment, out);
    }
    std::fill_n(out.begin(), dof, T(0));
    std::fill_n(out.end() - dof, dof, T(0));
  }

 private:
  // Adds the forces of one other arm to the frames of this one; moments are about the world's origin.
  bool push_from(const Motion<V>& m, const Motion<V>& o, int k, Vec3<V>* push, Vec3<V>* moment) {
    const V d0 = splat<V>(T(options_.d0));
    bool any = false;
    for (size_t i = 1; i < m.arm->links.size(); ++i) {
      const auto& A = m.arm->links[i];
      const auto ca = m.centers(m.links, static_cast<int>(i), k);
      for (size_t j = 0; j < o.arm->links.size(); ++j) {
        const auto& B = o.arm->links[j];
        const auto cb = j == 0 ? fixed(B.bound) : o.centers(o.links, static_cast<int>(j), k);
        if (!bits<V>(closer(ca, cb, d0 + (A.bound.r + B.bound.r)))) continue;
        for (int ga = A.groups.first; ga < A.groups.first + A.groups.count; ++ga) {
          const auto pa = m.centers(m.groups, ga, k);
          for (int gb = B.groups.first; gb < B.groups.first + B.groups.count; ++gb) {
            const auto pb = j == 0 ? fixed(o.arm->groups[gb]) : o.centers(o.groups, gb, k);
            if (!bits<V>(closer(pa, pb, d0 + (m.arm->groups[ga].r + o.arm->groups[gb].r)))) continue;
            any |= spheres(m, ga, o, gb, j == 0, k, push[A.frame], moment[A.frame]);
          }
        }
      }
    }
    return any;
  }

  bool spheres(const Motion<V>& m, int ga, const Motion<V>& o, int gb, bool base, int k, Vec3<V>& push,
               Vec3<V>& moment) {
    const Range sa = m.arm->group_spheres[ga], sb = o.arm->group_spheres[gb];
    const T d0 = T(options_.d0), k_rep = T(options_.k_rep);
    bool any = false;
    for (int i = sa.first; i < sa.first + sa.count; ++i) {
      const auto p = m.centers(m.spheres, i, k);
      Vec3<V> sum{V{}, V{}, V{}};
      bool mine = false;
      for (int j = sb.first; j < sb.first + sb.count; ++j) {
        const auto away = p - (base ? fixed(o.arm->spheres[j]) : o.centers(o.spheres, j, k));
        const V d2 = dot(away, away);
        const T radii = options_.centre_distance ? T(0) : m.arm->spheres[i].r + o.arm->spheres[j].r;
        const Mask<V> near = d2 <= splat<V>((d0 + radii) * (d0 + radii));
        if (!bits<V>(near)) continue;
        const V centres = max(sqrt<V>(d2), splat<V>(T(1e-6)));
        const V d = max(centres - radii, splat<V>(T(kDistanceFloor)));
        const V inverse = T(1) / d;
        const V size = max(k_rep * (inverse - T(1) / d0) * inverse * inverse, V{});
        sum = sum + away * select<V>(near, size / centres, V{});
        mine = true;
      }
      if (!mine) continue;
      push = push + sum;
      moment = moment + cross(p, sum);
      any = true;
    }
    return any;
  }

  void transpose_jacobian(const Motion<V>& m, Pose<V>& pose, int k, const Vec3<V>* push, const Vec3<V>* moment,
                          std::vector<T>& out) {
    const int dof = m.arm->dof;
    V joints[kMaxDof];
    for (int lane = 0; lane < width<V>; ++lane)
      for (int j = 0; j < dof; ++j) joints[j][lane] = m.at(k + lane)[j];
    forward(joints, pose);
    // From the tip inwards: a joint feels all that acts beyond it.
    Vec3<V> total{V{}, V{}, V{}}, turn = total;
    for (int j = dof; j >= 1; --j) {
      total = total + push[j];
      turn = turn + moment[j];
      const auto& f = pose.frames[j];
      const Vec3<V> axis{f.r[2], f.r[5], f.r[8]};
      const V torque = dot(axis, turn - cross(f.p, total));
      for (int lane = 0; lane < width<V> && k + lane <= m.last; ++lane)
        out[static_cast<size_t>(k + lane) * dof + (j - 1)] = torque[lane];
    }
  }

  static Vec3<V> fixed(const Sphere<T>& s) { return {splat<V>(s.x), splat<V>(s.y), splat<V>(s.z)}; }

 public:
  struct Result {
    std::vector<T> positions;  // `safe`: the last trajectory that broke no constraint
    int iterations = 0;
    bool moved = false, input_breaks_constraint = false;
    std::vector<std::vector<T>> trace;  // every accepted iterate, where asked for
  };

  // Algorithm ModifyMotion. `max_step`: v_max dt per joint [rad]; `keep`: levels that static contacts are proved at;
  // `constraint_margin`: a constraint is broken where surfaces are closer than this at a step or half-step.
  Result modify(const Motion<V>& input, const std::vector<const Motion<V>*>& others,
                const std::vector<Constraint<V>*>& constraints, const T* max_step, Levels<T> keep, T constraint_margin,
                bool trace, const Clock& clock) {
    Result out;
    const auto& arm = *input.arm;
    const int dof = arm.dof, last = input.last;
    out.positions = input.q;
    out.input_breaks_constraint = broken(input, constraints, constraint_margin);
    std::vector<T> current = input.q, next, forces;
    auto motion = std::make_unique<Motion<V>>(input);
    for (int it = 0; it < options_.max_iterations && !clock.expired(); ++it) {
      force(*motion, others, forces);
      step_of(forces, last, dof);
      next = current;
      bool any = false;
      for (int k = 1; k < last; ++k)
        for (int j = 0; j < dof; ++j) {
          T& q = next[static_cast<size_t>(k) * dof + j];
          const T to = std::clamp(q + forces[static_cast<size_t>(k) * dof + j], arm.lower[j], arm.upper[j]);
          any |= std::abs(to - q) > T(1e-7);
          q = to;
        }
      if (!any || !near_neighbours(next, last, dof, max_step)) break;
      if (!static_free(input.arm_index, current, next, last, dof, keep, clock)) break;
      current = next;
      motion = std::make_unique<Motion<V>>(*world().cell, input.arm_index, current);
      ++out.iterations;
      if (trace) out.trace.push_back(current);
      if (broken(*motion, constraints, constraint_margin)) continue;
      out.positions = current;
      out.moved = true;
      if (options_.comfort >= 0 && comfortable(*motion, others)) break;
    }
    return out;
  }

  // Whether a motion breaks a constraint at a step or half-step within its window, or at the instant that it is for.
  bool broken(const Motion<V>& m, const std::vector<Constraint<V>*>& constraints, T margin) {
    const int dof = m.arm->dof;
    Pose<V> pose(*m.arm);
    V q[kMaxDof], none[kMaxDof]{}, reach[kMaxLinks]{};
    for (auto* c : constraints) {
      instants_of(c->window, m.last);
      for (size_t first = 0; first < instants_.size(); first += width<V>) {
        for (int lane = 0; lane < width<V>; ++lane) {
          const double t = instants_[std::min(first + lane, instants_.size() - 1)];
          const int k = static_cast<int>(std::min(t, double(m.last)));
          const T f = T(std::min(t - k, 1.0));
          const T *lo = m.at(k), *hi = m.at(k + 1);
          for (int j = 0; j < dof; ++j) q[j][lane] = lo[j] + f * (hi[j] - lo[j]);
        }
        forward(q, pose);
        Contacts<V> out;
        c->contacts(q, none, pose, reach, {margin, margin}, out);
        if (bits<V>(out.hit)) return true;
      }
    }
    return false;
  }

 private:
  StaticWorld<V>& world() { return prover_.world(); }

  // Half-steps strictly inside a window, up to one step after the motion's end; or the instant.
  void instants_of(const Window& window, int last) {
    instants_.clear();
    if (window.is_instant()) {
      if (window.from >= 0) instants_.push_back(window.from);
      return;
    }
    const double until = std::min(window.until, std::max(double(last), std::ceil(window.from)) + 1);
    for (double h = std::max(0.0, std::floor(2 * window.from) + 1); h < 2 * until; ++h) instants_.push_back(h / 2);
    if (instants_.empty() && window.until > 0) instants_.push_back((std::max(window.from, 0.0) + window.until) / 2);
  }

  // Forces become joint steps, in place.
  void step_of(std::vector<T>& f, int last, int dof) {
    if (options_.normalised) {
      smooth(f, last, dof);
      T largest = 0;
      for (const T x : f) largest = std::max(largest, std::abs(x));
      const T scale = largest > 0 ? T(options_.normalised_step) / largest : T(0);
      for (T& x : f) x *= scale;
    } else {
      for (T& x : f) x *= T(options_.alpha);
    }
    const T cap = T(options_.max_step);
    for (T& x : f) x = std::clamp(x, -cap, cap);
  }

  // Gaussian over time, sigma = 3 steps; the ends stay. The weights exp(-d^2 / 18) are written out: exp() differs in
  // the last bit between C libraries, and plans must not.
  static void smooth(std::vector<T>& f, int last, int dof) {
    constexpr int radius = 9;
    constexpr T weight[radius + 1] = {T(1),           T(0.945959469), T(0.800737403), T(0.606530660), T(0.411112291),
                                      T(0.249352209), T(0.135335283), T(0.065728528), T(0.028565500), T(0.011108997)};
    T total = weight[0];
    for (int d = 1; d <= radius; ++d) total += 2 * weight[d];
    const std::vector<T> in = f;
    for (int k = 1; k < last; ++k)
      for (int j = 0; j < dof; ++j) {
        T sum = 0;
        for (int d = -radius; d <= radius; ++d)
          if (k + d >= 0 && k + d <= last) sum += weight[std::abs(d)] * in[static_cast<size_t>(k + d) * dof + j];
        f[static_cast<size_t>(k) * dof + j] = sum / total;
      }
  }

  static bool near_neighbours(const std::vector<T>& q, int last, int dof, const T* max_step) {
    for (int k = 0; k < last; ++k)
      for (int j = 0; j < dof; ++j)
        if (std::abs(q[static_cast<size_t>(k + 1) * dof + j] - q[static_cast<size_t>(k) * dof + j]) > 3 * max_step[j])
          return false;
    return true;
  }

  // Steps whose ends have not moved were free before.
  bool static_free(int a, const std::vector<T>& before, const std::vector<T>& after, int last, int dof, Levels<T> keep,
                   const Clock& clock) {
    changed_.clear();
    const auto same = [&](int k) {
      return std::equal(before.begin() + k * dof, before.begin() + (k + 1) * dof, after.begin() + k * dof);
    };
    for (int k = 0; k < last; ++k)
      if (!same(k) || !same(k + 1)) changed_.push_back(k);
    std::vector<SegmentResult<T>> results(changed_.size());
    const auto at = [&](int s) {
      const T* p = after.data() + static_cast<size_t>(changed_[s]) * dof;
      return std::pair<const T*, const T*>(p, p + dof);
    };
    prover_.alone(a, static_cast<int>(changed_.size()), at, keep, Stop::at_first_contact, results.data(), &clock);
    for (const auto& r : results)
      if (!r.free) return false;
    return true;
  }

  bool comfortable(const Motion<V>& m, const std::vector<const Motion<V>*>& others) {
    const T wanted = T(options_.comfort);
    for (const auto* o : others) {
      pairs_(m, *o, {wanted, wanted * T(0.6)}, instants_);
      if (!instants_.empty()) return false;
    }
    return true;
  }

  RepulsionOptions options_;
  Prover<V> prover_;
  PairCheck<V> pairs_;
  std::vector<int> changed_;
  std::vector<double> instants_;
};

}  // namespace mmp
