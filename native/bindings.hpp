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

// The elements of a sequence that came from Python, held: another thread may empty the list while the lock is released.
template <class T>
class Held {
 public:
  Held(nb::handle sequence, const char* expected) {
    for (nb::handle item : sequence) {
      if (item.is_none() || !nb::isinstance<T>(item)) throw nb::type_error(expected);
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
  // Also the range of sincos(); a proof about NaN would prove nothing.
  need(std::all_of(q.data(), q.data() + q.size(), [](double x) { return std::abs(x) < 1e4; }),
       "configurations must be finite");
}

inline void need_rows(const Cell& cell, int arm, const Matrix& q) {
  need(cell.frozen, "the cell is not frozen");
  need(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
  need_configurations(q, cell.precise.arms[arm].dof);
}

inline void need_joints(const Cell& cell, int arm, const Vector& q) {
  need(cell.frozen, "the cell is not frozen");
  need(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
  need(q.shape(0) == static_cast<size_t>(cell.precise.arms[arm].dof), "wrong number of joints");
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
