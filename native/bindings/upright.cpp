#include "bindings/bindings.hpp"
#include "geometry/upright_projection.hpp"

namespace mmp {

namespace {

template <class T>
void set_upright(ArmModel<T>& arm, const double* axis, double within) {
  std::array<double, 3> in_last{};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) in_last[i] += double(arm.tool.r[3 * i + k]) * axis[k];
  arm.upright = upright_within<T>(in_last, within);
}

const ArmModel<double>& bound_arm(const Cell& cell, int arm) {
  const auto& model = arm_of(cell, arm);
  require(model.upright.has_value(), "the arm has no bound on its tool axis");
  return model;
}

// Calls `row(pose, lane, index)` for the pose of each of n configurations.
template <class Row>
void for_each_pose(const ArmModel<double>& model, const double* q, size_t n, const Row& row) {
  Pose<Doubles> pose(model);
  Doubles joints[kMaxDof];
  for (size_t k = 0; k < n; k += width<Doubles>) {
    load_rows(q, n, k, model.dof, joints);
    forward(joints, pose);
    for (int lane = 0; lane < width<Doubles> && k + lane < n; ++lane) row(pose, lane, k + lane);
  }
}

}  // namespace

void bind_upright(nb::module_& m) {
  m.def(
      "keep_upright",
      [](Cell& cell, int arm, Vector axis, double within) {
        require(!cell.frozen, "the cell is frozen");
        require(arm >= 0 && arm < static_cast<int>(cell.single.arms.size()), "no such arm");
        require(axis.shape(0) == 3 && all_within(axis.data(), 3, 2), "an axis has 3 finite numbers");
        const double* a = axis.data();
        require(std::abs(std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) - 1) < 1e-6, "an axis has the length 1");
        require(within > 0 && within < 1.5708, "the bound must be above 0 and at most a right angle");
        set_upright(cell.single.arms[arm], a, within);
        set_upright(cell.precise.arms[arm], a, within);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("axis"), nb::arg("within"),
      "Bounds the angle between an axis of the tool and the world's z axis, in a cell that is not frozen. axis [3]: "
      "unit "
      "vector in the tool frame. within: largest angle [rad], at most a right angle.");

  m.def(
      "tool_axes",
      [](const Cell& cell, int arm, Matrix q) {
        require_rows(cell, arm, q);
        const auto& model = bound_arm(cell, arm);
        const size_t n = q.shape(0);
        std::vector<double> out(n * 3);
        {
          nb::gil_scoped_release release;
          for_each_pose(model, q.data(), n, [&](const Pose<Doubles>& pose, int lane, size_t k) {
            const auto axis = tool_axis(pose);
            out[3 * k] = axis.x[lane], out[3 * k + 1] = axis.y[lane], out[3 * k + 2] = axis.z[lane];
          });
        }
        return to_numpy<Out2>(std::move(out), n, 3);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"),
      "Returns the directions [n, 3] in the world of the tool axis that an arm keeps upright.");

  m.def(
      "project_upright",
      [](const Cell& cell, int arm, Matrix q) {
        require_rows(cell, arm, q);
        const auto& model = bound_arm(cell, arm);
        const size_t n = q.shape(0), dof = q.shape(1);
        std::vector<double> rows(q.data(), q.data() + q.size());
        std::vector<bool> reached(n);
        {
          nb::gil_scoped_release release;
          UprightProjection<Doubles> project(model);
          for (size_t k = 0; k < n; ++k) reached[k] = project(rows.data() + k * dof);
        }
        return std::pair(to_numpy<Out2>(std::move(rows), n, dof), to_numpy<Flags>(reached, n));
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"),
      "Returns configurations [n, dof] moved inside the bound of the tool axis and within the joint limits, and "
      "whether "
      "that worked [n].");
}

}  // namespace mmp
