// Repulsive trajectory modification: gradient descent of APF-ECBS along its force field (ModifyMotion).
#pragma once

#include <memory>

#include "proof/pair_check.hpp"
#include "repulsion/repulsion.hpp"
#include "single_arm/constraints.hpp"

namespace mmp {

template <class V>
class ModifyMotion {
 public:
  using T = Scalar<V>;
  ModifyMotion(StaticWorld<V>& world, const RepulsionSettings& settings)
      : repulsion_(settings), settings_(settings), prover_(world), pairs_(world) {}

  struct Result {
    std::vector<T> positions;  // last trajectory that broke no constraint
    int iterations = 0;
    bool moved = false, input_breaks_constraint = false;
    std::vector<std::vector<T>> trace;  // every accepted iterate, on request
  };

  // `max_step`: v_max dt per joint [rad]. `keep`: levels of the proof against static bodies. A constraint is broken
  // when surfaces are closer than `constraint_margin` at a quarter of a step. Repelled steps may be long (`stretch`),
  // so half-steps would miss contacts.
  Result run(const Motion<V>& input, const std::vector<const Motion<V>*>& others,
             const std::vector<Constraint<V>*>& constraints, const T* max_step, Levels<T> keep, T constraint_margin,
             bool trace, const Clock& clock) {
    Result out;
    const auto& arm = *input.arm;
    const int dof = arm.dof, last = input.last;
    out.positions = input.q;
    out.input_breaks_constraint = breaks(input, constraints, constraint_margin);
    std::vector<T> current = input.q, next, forces;
    std::vector<double> exact(input.q.begin(), input.q.end()), moved;  // small steps add up in double precision
    auto motion = std::make_unique<Motion<V>>(input);
    for (int it = 0; it < settings_.max_iterations && !clock.expired(); ++it) {
      repulsion_.force(*motion, others, forces);
      step_of(forces, dof);
      const auto possible = [&] {
        return step(arm, exact, forces, last, moved, next) && near_neighbours(next, last, dof, max_step) &&
               static_free(input.arm_index, current, next, last, dof, keep, clock);
      };
      bool goes_on = possible();
      for (int halved = 0; !goes_on && halved < settings_.halvings && !clock.expired(); ++halved) {
        for (T& x : forces) x /= 2;
        goes_on = possible();
      }
      if (!goes_on) break;
      current = next;
      exact = moved;
      motion = std::make_unique<Motion<V>>(*prover_.world().cell, input.arm_index, current);
      ++out.iterations;
      if (trace) out.trace.push_back(current);
      if (breaks(*motion, constraints, constraint_margin)) continue;
      out.positions = current;
      out.moved = true;
      if (settings_.comfort >= 0 && comfortable(*motion, others)) break;
    }
    return out;
  }

 private:
  // Adds joint steps to a trajectory, within the joint limits, and rounds it. Returns whether anything moves.
  static bool step(const ArmModel<T>& arm, const std::vector<double>& from, const std::vector<T>& steps, int last,
                   std::vector<double>& out, std::vector<T>& rounded) {
    bool any = false;
    out = from;
    for (int k = 1; k < last; ++k)
      for (int j = 0; j < arm.dof; ++j) {
        const size_t at = static_cast<size_t>(k) * arm.dof + j;
        out[at] = std::clamp(from[at] + steps[at], double(arm.lower[j]), double(arm.upper[j]));
        any |= out[at] != from[at];
      }
    rounded.assign(out.begin(), out.end());
    return any;
  }

  // Converts forces to joint steps, in place.
  void step_of(std::vector<T>& f, int dof) {
    if (settings_.normalised) {
      smooth(f, dof);
      T largest = 0;
      for (const T x : f) largest = std::max(largest, std::abs(x));
      const T scale = largest > 0 ? T(settings_.normalised_step) / largest : T(0);
      for (T& x : f) x *= scale;
    } else {
      for (T& x : f) x *= T(settings_.alpha);
    }
    const T cap = T(settings_.max_step);
    if (cap > 0)
      for (T& x : f) x = std::clamp(x, -cap, cap);
  }

  // Gaussian over time, sigma = 6 steps; the ends stay. The weights exp(-d^2 / 72) are literals: exp() differs in the
  // last bit between C libraries, and plans must not.
  static void smooth(std::vector<T>& f, int dof) {
    constexpr int radius = 18;
    constexpr T weight[radius + 1] = {T(1),           T(0.986207117), T(0.945959469), T(0.882496903), T(0.800737403),
                                      T(0.706648278), T(0.606530660), T(0.506335617), T(0.411112291), T(0.324652467),
                                      T(0.249352209), T(0.186270464), T(0.135335283), T(0.095634445), T(0.065728529),
                                      T(0.043936934), T(0.028565501), T(0.018063013), T(0.011108997)};
    T total = weight[0];
    for (int d = 1; d <= radius; ++d) total += 2 * weight[d];
    const std::vector<T> in = f;
    const int size = static_cast<int>(in.size());
    std::fill(f.begin(), f.end(), T(0));
    for (int d = -radius; d <= radius; ++d) {  // the inner loop is over all steps and joints: it becomes vectors
      const T w = weight[std::abs(d)];
      const int shift = d * dof, end = std::min(size - dof, size - shift);
      for (int at = std::max(dof, -shift); at < end; ++at) f[at] += w * in[at + shift];
    }
    for (int at = dof; at < size - dof; ++at) f[at] /= total;
    std::copy_n(in.begin(), dof, f.begin());
    std::copy_n(in.end() - dof, dof, f.end() - dof);
  }

  bool near_neighbours(const std::vector<T>& q, int last, int dof, const T* max_step) const {
    if (settings_.stretch == 0) return true;
    for (int k = 0; k < last; ++k)
      for (int j = 0; j < dof; ++j)
        if (std::abs(q[static_cast<size_t>(k + 1) * dof + j] - q[static_cast<size_t>(k) * dof + j]) >
            T(settings_.stretch) * max_step[j])
          return false;
    return true;
  }

  // Steps with unchanged ends are known to be free.
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
    const T wanted = T(settings_.comfort);
    for (const auto* o : others) {
      if (!m.whole.near(o->whole, wanted * T(1.01))) continue;
      pairs_(m, *o, {wanted, wanted * T(0.6)}, instants_);
      if (!instants_.empty()) return false;
    }
    return true;
  }

  Repulsion<V> repulsion_;
  RepulsionSettings settings_;
  Prover<V> prover_;
  PairCheck<V> pairs_;
  std::vector<int> changed_;
  std::vector<double> instants_;
};

}  // namespace mmp
