// What the binding's parts share: array types, checks of what would crash, conversions.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "cell.hpp"

namespace nb = nanobind;

namespace mmp {

void bind_cell(nb::module_& m);    // the cell and its batch queries
void bind_search(nb::module_& m);  // motions, constraints, single-arm search, repulsion

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

inline void need_rows(const Cell& cell, int arm, const Matrix& q) {
  need(cell.frozen, "the cell is not frozen");
  need(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
  need(q.shape(1) == static_cast<size_t>(cell.precise.arms[arm].dof), "wrong number of joints");
  // Also the range of sincos(); a proof about NaN would prove nothing.
  need(std::all_of(q.data(), q.data() + q.size(), [](double x) { return std::abs(x) < 1e4; }),
       "configurations must be finite");
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

inline Levels<float> levels_of(double margin, double proof) { return {float(margin), float(proof)}; }

inline std::vector<double> rows_of(const std::vector<float>& values) { return {values.begin(), values.end()}; }

}  // namespace mmp
