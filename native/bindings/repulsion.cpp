#include "bindings/bindings.hpp"
#include "repulsion/modify_motion.hpp"

namespace mmp {

void bind_repulsion(nb::module_& m) {
  m.def(
      "repulsive_force",
      [](const Cell& cell, const SearchMotion& motion, nb::handle others, double k_rep, double d0,
         bool centre_distance) {
        require_motion(cell, motion);
        const auto held = held_motions(others, cell.single, motion.arm_index);
        const RepulsionOptions options{checked_size(k_rep), checked_positive(d0), centre_distance};
        std::vector<float> out;
        {
          nb::gil_scoped_release release;
          Repulsion<Floats>(options).force(motion, held.read_only(), out);
        }
        const size_t dof = motion.arm->dof;
        return to_numpy<Out2>(rows_of(out), out.size() / dof, dof);
      },
      nb::arg("cell"), nb::arg("motion"), nb::arg("others"), nb::arg("k_rep"), nb::arg("d0"),
      nb::arg("centre_distance"),
      nb::sig("def repulsive_force(cell: Cell, motion: Motion, others: collections.abc.Sequence[Motion], k_rep: float, "
              "d0: float, centre_distance: bool) -> numpy.ndarray"),
      "Joint forces J^T F [steps + 1, dof] on the inner steps of a motion.");

  m.def(
      "modify_motion",
      [](const Cell& cell, const SearchMotion& motion, nb::handle others, nb::handle constraints, Vector max_step_rad,
         const Levels<double>& levels, double constraint_margin, const Clock& clock, double alpha, double k_rep,
         double d0, int max_iterations, bool centre_distance, bool normalised, double normalised_step, double max_step,
         double comfort, bool trace) {
        require_motion(cell, motion);
        require_steps(cell, motion.arm_index, max_step_rad);
        const auto obstacles = held_motions(others, cell.single, motion.arm_index);
        const auto rules = held_constraints(constraints, motion.arm->dof);
        const RepulsionOptions force{checked_size(k_rep), checked_positive(d0), centre_distance};
        const DescentOptions options{
            checked_number(alpha),         checked_count(max_iterations), normalised,
            checked_size(normalised_step), checked_size(max_step),        checked_number(comfort)};
        ModifyMotion<Floats>::Result result;
        {
          nb::gil_scoped_release release;
          ModifyMotion<Floats> descent(*cell.world_planning, force, options);
          result = descent.run(motion, obstacles.read_only(), rules.items(), as<float>(max_step_rad).data(),
                               as_float(levels), float(checked_number(constraint_margin)), trace, clock);
        }
        const size_t dof = motion.arm->dof, rows = result.positions.size() / dof;
        nb::list steps;
        for (auto& t : result.trace) steps.append(to_numpy<Out2>(rows_of(t), rows, dof));
        return nb::make_tuple(to_numpy<Out2>(rows_of(result.positions), rows, dof), result.moved, result.iterations,
                              result.input_breaks_constraint, steps);
      },
      nb::arg("cell"), nb::arg("motion"), nb::arg("others"), nb::arg("constraints"), nb::arg("max_step_rad"),
      nb::arg("levels"), nb::arg("constraint_margin"), nb::arg("clock"), nb::arg("alpha"), nb::arg("k_rep"),
      nb::arg("d0"), nb::arg("max_iterations"), nb::arg("centre_distance"), nb::arg("normalised"),
      nb::arg("normalised_step"), nb::arg("max_step"), nb::arg("comfort"), nb::arg("trace") = false,
      nb::sig("def modify_motion(cell: Cell, motion: Motion, others: collections.abc.Sequence[Motion], constraints: "
              "collections.abc.Sequence[Constraint], max_step_rad: numpy.ndarray, levels: Levels, "
              "constraint_margin: float, clock: Clock, alpha: float, k_rep: float, d0: float, max_iterations: int, "
              "centre_distance: bool, normalised: bool, normalised_step: float, max_step: float, comfort: float, "
              "trace: bool = False) -> tuple[numpy.ndarray, bool, int, bool, list[numpy.ndarray]]"),
      "ModifyMotion: (positions, moved, iterations, whether the input broke a constraint, iterates if traced).");

  m.def(
      "breaks_constraint",
      [](const Cell& cell, const SearchMotion& motion, nb::handle constraints, double margin) {
        require_motion(cell, motion);
        const auto rules = held_constraints(constraints, motion.arm->dof);
        nb::gil_scoped_release release;
        return breaks(motion, rules.items(), float(checked_number(margin)));
      },
      nb::arg("cell"), nb::arg("motion"), nb::arg("constraints"), nb::arg("margin"),
      nb::sig("def breaks_constraint(cell: Cell, motion: Motion, constraints: collections.abc.Sequence[Constraint], "
              "margin: float) -> bool"),
      "Whether a motion comes closer than `margin` [m] to what its constraints forbid, within their windows.");
}

}  // namespace mmp
