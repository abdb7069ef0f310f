// Shared by all bindings: array types, checks of arguments that would crash the core, conversions.
#pragma once

#include <algorithm>
#include <functional>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "geometry/cell.hpp"
#include "single_arm/single_arm.hpp"

namespace nb = nanobind;

namespace mmp {

void bind_cell(nb::module_& m);                // the cell: arms and obstacles
void bind_hulls(nb::module_& m);               // distances of convex hulls
void bind_queries(nb::module_& m);             // batch queries of a cell: kinematics, clearance, proofs
void bind_upright(nb::module_& m);             // bounds on the angle of a tool axis
void bind_motion(nb::module_& m);              // motions, their conflicts, and constraints
void bind_single_arm(nb::module_& m);          // single-arm search and its tree
void bind_repulsion(nb::module_& m);           // repulsive force and ModifyMotion
void bind_joint_space(nb::module_& m);         // search in the joint space of all arms
void bind_improve(nb::module_& m);             // shortcutting, replanning and path recombination
void bind_inverse_kinematics(nb::module_& m);  // configurations for tool poses
void bind_covers(nb::module_& m);              // sphere covers of links

using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Pairs = nb::ndarray<const int32_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Out1 = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using Out2 = nb::ndarray<nb::numpy, double, nb::ndim<2>>;
using Out3 = nb::ndarray<nb::numpy, double, nb::ndim<3>>;
using Booleans = nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<nb::numpy, bool, nb::ndim<1>>;
using Flags2 = nb::ndarray<nb::numpy, bool, nb::ndim<2>>;
using Windows = nb::ndarray<nb::numpy, int32_t, nb::ndim<2>>;

template <class Array, class From, class... Shape>
Array to_numpy(std::vector<From> values, Shape... shape) {
  using To = typename Array::Scalar;
  auto* data = new To[values.size() + 1];
  std::copy(values.begin(), values.end(), data);
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<To*>(p); });
  return Array(data, {static_cast<size_t>(shape)...}, owner);
}

inline void require(bool ok, const char* message) {
  if (!ok) throw nb::value_error(message);
}

inline constexpr double kMaxJoint = 1e4;      // [rad], the range of sincos()
inline constexpr double kMaxLength = 1e6;     // [m]
inline constexpr size_t kMaxVertices = 4096;  // of a hull
inline constexpr double kMaxNumber = 1e9;     // its products stay finite in single precision
inline constexpr int kMaxCount = 1000000000;  // two of them fit an int
inline constexpr size_t kMaxRows = 1 << 26;   // with all joints of an arm they fit an int
inline constexpr double kMaxSteps = 1e6;      // of a straight edge
inline constexpr double kMinStep = 1e-5;      // [rad]; with less the number of steps would not fit an int

// NaN fails this check and all that follow: a comparison with NaN would count as far apart.
inline bool all_within(const double* values, size_t n, double most) {
  return std::all_of(values, values + n, [=](double x) { return std::abs(x) < most; });
}

// Checks lengths [m] and entries of rotation matrices.
inline void require_lengths(const double* values, size_t n) {
  require(all_within(values, n, kMaxLength), "poses and sizes must be finite, and within 1e6 m");
}

// Returns a body for queries in double precision, see `add_obstacle`.
Obstacle<double> checked_obstacle(int shape, const Vector& pose, const Vector& size);

inline std::vector<Point> checked_vertices(const Matrix& vertices, double radius) {
  require(vertices.shape(0) > 0 && vertices.shape(0) <= kMaxVertices && vertices.shape(1) == 3,
          "a hull has 1 to 4096 vertices of 3 numbers");
  require_lengths(vertices.data(), vertices.size());
  require(radius >= 0 && radius < kMaxLength, "a radius must be 0 to 1e6 m");
  std::vector<Point> points;
  for (size_t k = 0; k < vertices.shape(0); ++k) {
    const double* p = vertices.data() + 3 * k;
    points.push_back({p[0], p[1], p[2]});
  }
  return points;
}

inline double checked_number(double x) {
  require(std::abs(x) < kMaxNumber, "numbers must be finite, and smaller than 1e9");
  return x;
}
inline double checked_size(double x) {
  require(x >= 0, "a distance or a size must not be negative");
  return checked_number(x);
}
inline double checked_positive(double x) {
  require(x > 0, "a size must be positive");
  return checked_number(x);
}
inline double checked_share(double x) {
  require(x >= 0 && x <= 1, "a share must be from 0 to 1");
  return x;
}
inline int checked_count(int n) {
  require(n >= 0 && n <= kMaxCount, "a count must be from 0 to 1e9");
  return n;
}

// Holds the elements of a Python sequence: another thread may empty the list while the lock is released.
template <class T>
class Held {
 public:
  Held(nb::handle sequence, const char* expected) {
    for (nb::handle item : sequence) {
      // An object of Motion.__new__(Motion) is not initialised.
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

inline void require_configurations(const Matrix& q, int dof) {
  require(q.shape(1) == static_cast<size_t>(dof), "wrong number of joints");
  require(q.shape(0) <= kMaxRows, "too many configurations");
  require(all_within(q.data(), q.size(), kMaxJoint), "configurations must be finite, and within 1e4 rad");
}

// Returns the rows of a matrix.
template <class T>
std::vector<std::vector<T>> separate_rows(const Matrix& q) {
  std::vector<std::vector<T>> out;
  for (size_t k = 0; k < q.shape(0); ++k) out.emplace_back(q.data() + k * q.shape(1), q.data() + (k + 1) * q.shape(1));
  return out;
}

inline void require_frozen(const Cell& cell) { require(cell.frozen, "the cell is not frozen"); }

inline const ArmModel<double>& arm_of(const Cell& cell, int arm) {
  require_frozen(cell);
  require(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
  return cell.precise.arms[arm];
}

// Returns the numbers of all arms.
inline std::vector<int> all_arms(const Cell& cell) {
  require_frozen(cell);
  std::vector<int> all(cell.single.arms.size());
  for (size_t a = 0; a < all.size(); ++a) all[a] = static_cast<int>(a);
  return all;
}

inline void require_rows(const Cell& cell, int arm, const Matrix& q) {
  require_configurations(q, arm_of(cell, arm).dof);
}

inline void require_joints(const Cell& cell, int arm, const Vector& q) {
  require(q.shape(0) == static_cast<size_t>(arm_of(cell, arm).dof), "wrong number of joints");
  require(all_within(q.data(), q.size(), kMaxJoint), "a configuration must be finite, and within 1e4 rad");
}

// Checks the largest move of each joint in one step.
inline void require_steps(const Cell& cell, int arm, const Vector& steps) {
  require(steps.shape(0) == static_cast<size_t>(arm_of(cell, arm).dof), "wrong number of joints");
  require(
      std::all_of(steps.data(), steps.data() + steps.size(), [](double x) { return x >= kMinStep && x < kMaxJoint; }),
      "steps must be from 1e-5 to 1e4 rad");
}

// Checks the number of such steps on a straight edge.
inline void require_few_steps(const double* from, const double* to, const Vector& steps) {
  for (size_t k = 0; k < steps.size(); ++k)
    require(std::abs(to[k] - from[k]) <= kMaxSteps * steps.data()[k], "a straight edge has at most 1e6 steps");
}

template <class T>
std::vector<T> as(const Vector& v) {
  return {v.data(), v.data() + v.size()};
}

using SearchMotion = Motion<Floats>;
using SearchConstraint = Constraint<Floats>;
using SearchArm = SingleArm<Floats>;

inline void require_motion(const Cell& cell, const SearchMotion& m) {
  const auto k = static_cast<size_t>(m.arm_index);
  require(k < cell.single.arms.size() && m.arm == &cell.single.arms[k], "a motion of another cell");
}

// Accepts motions of this cell; with `arm`, only motions of other arms.
inline Held<SearchMotion> held_motions(nb::handle sequence, const CellModel<float>& cell, int arm = -1) {
  Held<SearchMotion> held(sequence, "a sequence of Motion is needed");
  for (const auto* m : held.items()) {
    const auto k = static_cast<size_t>(m->arm_index);
    require(k < cell.arms.size() && m->arm == &cell.arms[k], "a motion of another cell");
    require(m->arm_index != arm, "a motion of the arm itself");
  }
  return held;
}

inline Held<SearchConstraint> held_constraints(nb::handle sequence, int dof) {
  Held<SearchConstraint> held(sequence, "a sequence of Constraint is needed");
  for (const auto* c : held.items())
    require(c->joints() == 0 || c->joints() == dof, "the constraint has another number of joints than the arm");
  return held;
}

inline Window window_of(double start, double end) {
  require(start <= end, "a window's start must not be after its end");
  const auto capped = [](double t) { return std::clamp(t, -double(kForever), double(kForever)); };
  return {capped(start), capped(end)};
}

inline Levels<float> as_float(const Levels<double>& l) {
  return {float(l.margin), float(l.proof), float(l.obstacles), float(l.self), float(l.upright)};
}

inline std::vector<double> rows_of(const std::vector<float>& values) { return {values.begin(), values.end()}; }

}  // namespace mmp
