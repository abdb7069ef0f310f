// What the binding's parts share: array types, checks of what would crash, conversions.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "cell.hpp"
#include "single_arm.hpp"

namespace nb = nanobind;

namespace mmp {

void bind_cell(nb::module_& m);       // the cell: arms and obstacles
void bind_queries(nb::module_& m);    // its batch queries: kinematics, clearance, proofs
void bind_motion(nb::module_& m);     // motions and where they are in conflict, constraints
void bind_search(nb::module_& m);     // single-arm search
void bind_repulsion(nb::module_& m);  // the repulsive force, and motions modified by it
void bind_joint(nb::module_& m);      // composite search; shortcutting, replanning and recombination of plans
void bind_tree(nb::module_& m);       // the tree of a single-arm search, to look at

using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Pairs = nb::ndarray<const int32_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Out1 = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using Out2 = nb::ndarray<nb::numpy, double, nb::ndim<2>>;
using Out3 = nb::ndarray<nb::numpy, double, nb::ndim<3>>;
using Flags = nb::ndarray<nb::numpy, bool, nb::ndim<1>>;
using Windows = nb::ndarray<nb::numpy, int32_t, nb::ndim<2>>;

template <class Array, class From, class... Shape>
Array to_numpy(std::vector<From> values, Shape... shape) {
  using To = typename Array::Scalar;
  auto* data = new To[values.size() + 1];
  std::copy(values.begin(), values.end(), data);
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<To*>(p); });
  return Array(data, {static_cast<size_t>(shape)...}, owner);
}

inline void need(bool ok, const char* message) {
  if (!ok) throw nb::value_error(message);
}

inline constexpr double kMostJoint = 1e4;      // [rad], the range of sincos()
inline constexpr double kMostNumber = 1e9;     // its products stay finite in single precision
inline constexpr int kMostCount = 1000000000;  // two of them fit an int
inline constexpr size_t kMostRows = 1 << 26;   // with all joints of an arm they fit an int
inline constexpr double kMostSteps = 1e6;      // of a straight way
inline constexpr double kLeastStep = 1e-5;     // [rad]; with less the number of steps would not fit an int

// Not NaN either, as in all that follow: what is compared with NaN would count as far apart.
inline bool all_within(const double* values, size_t n, double most) {
  return std::all_of(values, values + n, [=](double x) { return std::abs(x) < most; });
}

inline double checked_number(double x) {
  need(std::abs(x) < kMostNumber, "numbers must be finite, and smaller than 1e9");
  return x;
}
inline double checked_size(double x) {
  need(x >= 0, "a distance or a size must not be negative");
  return checked_number(x);
}
inline double checked_positive(double x) {
  need(x > 0, "a size must be positive");
  return checked_number(x);
}
inline double checked_share(double x) {
  need(x >= 0 && x <= 1, "a share must be from 0 to 1");
  return x;
}
inline int checked_count(int n) {
  need(n >= 0 && n <= kMostCount, "a count must be from 0 to 1e9");
  return n;
}

// The elements of a sequence that came from Python, held: another thread may empty the list while the lock is released.
template <class T>
class Held {
 public:
  Held(nb::handle sequence, const char* expected) {
    for (nb::handle item : sequence) {
      // Not ready: Motion.__new__(Motion), whose memory holds nothing.
      if (item.is_none() || !nb::isinstance<T>(item) || !nb::inst_ready(item)) throw nb::type_error(expected);
      owners_.push_back(nb::borrow(item));
      items_.push_back(nb::inst_ptr<T>(item));
    }
  }
  const std::vector<T*>& items() const { return items_; }
  std::vector<const T*> read_only() const { return {items_.begin(), items_.end()}; }

 private:
  std::vector<nb::object> owners_;
  std::vector<T*> items_;
};

inline void need_configurations(const Matrix& q, int dof) {
  need(q.shape(1) == static_cast<size_t>(dof), "wrong number of joints");
  need(q.shape(0) <= kMostRows, "too many configurations");
  need(all_within(q.data(), q.size(), kMostJoint), "configurations must be finite, and within 1e4 rad");
}

inline void need_frozen(const Cell& cell) { need(cell.frozen, "the cell is not frozen"); }

inline const ArmModel<double>& arm_of(const Cell& cell, int arm) {
  need_frozen(cell);
  need(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
  return cell.precise.arms[arm];
}

inline void need_rows(const Cell& cell, int arm, const Matrix& q) { need_configurations(q, arm_of(cell, arm).dof); }

inline void need_joints(const Cell& cell, int arm, const Vector& q) {
  need(q.shape(0) == static_cast<size_t>(arm_of(cell, arm).dof), "wrong number of joints");
  need(all_within(q.data(), q.size(), kMostJoint), "a configuration must be finite, and within 1e4 rad");
}

// How far each joint of an arm may go in a step.
inline void need_steps(const Cell& cell, int arm, const Vector& steps) {
  need(steps.shape(0) == static_cast<size_t>(arm_of(cell, arm).dof), "wrong number of joints");
  need(std::all_of(steps.data(), steps.data() + steps.size(),
                   [](double x) { return x >= kLeastStep && x < kMostJoint; }),
       "steps must be from 1e-5 to 1e4 rad");
}

// The straight way between two configurations in such steps.
inline void need_few_steps(const double* from, const double* to, const Vector& steps) {
  for (size_t k = 0; k < steps.size(); ++k)
    need(std::abs(to[k] - from[k]) <= kMostSteps * steps.data()[k], "a straight way has 1e6 steps at most");
}

template <class T>
std::vector<T> as(const Vector& v) {
  return {v.data(), v.data() + v.size()};
}

using SearchMotion = Motion<Floats>;
using SearchConstraint = Constraint<Floats>;
using SearchArm = SingleArm<Floats>;

inline void need_motion(const Cell& cell, const SearchMotion& m) {
  const auto k = static_cast<size_t>(m.arm_index);
  need(k < cell.single.arms.size() && m.arm == &cell.single.arms[k], "a motion of another cell");
}

// Motions of arms of this cell; with `arm`, of others than that one.
inline Held<SearchMotion> held_motions(nb::handle sequence, const CellModel<float>& cell, int arm = -1) {
  Held<SearchMotion> held(sequence, "a sequence of Motion is needed");
  for (const auto* m : held.items()) {
    const auto k = static_cast<size_t>(m->arm_index);
    need(k < cell.arms.size() && m->arm == &cell.arms[k], "a motion of another cell");
    need(m->arm_index != arm, "a motion of the arm itself");
  }
  return held;
}

inline Held<SearchConstraint> held_constraints(nb::handle sequence, int dof) {
  Held<SearchConstraint> held(sequence, "a sequence of Constraint is needed");
  for (const auto* c : held.items())
    need(c->joints() == 0 || c->joints() == dof, "a ball constraint of another number of joints");
  return held;
}

inline Window window_of(double start, double end) {
  need(start <= end, "a window's start must not be after its end");
  const auto capped = [](double t) { return std::clamp(t, -double(kForever), double(kForever)); };
  return {capped(start), capped(end)};
}

inline Levels<float> as_float(const Levels<double>& l) {
  return {float(l.margin), float(l.proof), float(l.obstacles), float(l.self)};
}

inline std::vector<double> rows_of(const std::vector<float>& values) { return {values.begin(), values.end()}; }

}  // namespace mmp
