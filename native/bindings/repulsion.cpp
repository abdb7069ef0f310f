#include "bindings/bindings.hpp"
#include "repulsion/modify_motion.hpp"

namespace mmp {

namespace {

// Result of ModifyMotion, as Python sees it.
struct ModifiedMotion {
  nb::object positions;
  bool moved;
  int iterations;
  bool input_breaks_constraint;
  nb::list trace;
};

void bind_repulsion_settings(nb::module_& m) {
  using Settings = RepulsionSettings;
  const Settings defaults;
  nb::class_<Settings>(m, "RepulsionSettings", "Settings of the repulsive force field, and of the descent along it.")
      .def(
          "__init__",
          [](Settings* self, double k_rep, double d0, bool centre_distance, double alpha, int max_iterations,
             bool normalised, double normalised_step, double floor, double max_step, double stretch, double comfort,
             double exact_within, int halvings) {
            new (self)
                Settings{checked_size(k_rep),           checked_positive(d0),          centre_distance,
                         checked_number(alpha),         checked_count(max_iterations), normalised,
                         checked_size(normalised_step), checked_size(floor),           checked_size(max_step),
                         checked_size(stretch),         checked_number(comfort),       checked_size(exact_within),
                         checked_count(halvings)};
          },
          nb::kw_only(), nb::arg("k_rep") = defaults.k_rep, nb::arg("d0") = defaults.d0,
          nb::arg("centre_distance") = defaults.centre_distance, nb::arg("alpha") = defaults.alpha,
          nb::arg("max_iterations") = defaults.max_iterations, nb::arg("normalised") = defaults.normalised,
          nb::arg("normalised_step") = defaults.normalised_step, nb::arg("floor") = defaults.floor,
          nb::arg("max_step") = defaults.max_step, nb::arg("stretch") = defaults.stretch,
          nb::arg("comfort") = defaults.comfort, nb::arg("exact_within") = defaults.exact_within,
          nb::arg("halvings") = defaults.halvings)
      .def_ro("k_rep", &Settings::k_rep, "Gain of the force.")
      .def_ro("d0", &Settings::d0, "Range of the force [m].")
      .def_ro("centre_distance", &Settings::centre_distance,
              "Paper-literal setting: distances between sphere centres instead of surfaces.")
      .def_ro("alpha", &Settings::alpha, "Step of the descent.")
      .def_ro("max_iterations", &Settings::max_iterations, "Largest number of iterations.")
      .def_ro("normalised", &Settings::normalised, "Fixed largest step; forces are smoothed over time.")
      .def_ro("normalised_step", &Settings::normalised_step, "Largest step of a normalised iteration [rad].")
      .def_ro("floor", &Settings::floor, "Distance below which the force is constant [m]; 0: none.")
      .def_ro("max_step", &Settings::max_step, "Largest step of a joint in one iteration [rad]; 0: any.")
      .def_ro("stretch", &Settings::stretch,
              "Longest move between two waypoints, relative to one step at full speed; 0: any.")
      .def_ro("comfort", &Settings::comfort, "Clearance that ends the descent [m]; negative: never.")
      .def_ro("exact_within", &Settings::exact_within,
              "Distance of hulls below which they give the direction of the force [m]; 0: never.")
      .def_ro("halvings", &Settings::halvings, "How often a step that would end the descent is halved first.");
}

}  // namespace

void bind_repulsion(nb::module_& m) {
  bind_repulsion_settings(m);

  nb::class_<ModifiedMotion>(m, "ModifiedMotion", "Result of `modify_motion`.")
      .def_ro("positions", &ModifiedMotion::positions, nb::sig("def positions(self) -> numpy.ndarray"),
              "Last iterate [steps + 1, dof] that breaks no constraint.")
      .def_ro("moved", &ModifiedMotion::moved, "Whether `positions` differ from the input.")
      .def_ro("iterations", &ModifiedMotion::iterations, "Number of accepted iterations.")
      .def_ro("input_breaks_constraint", &ModifiedMotion::input_breaks_constraint,
              "Whether the input breaks a constraint.")
      .def_ro("trace", &ModifiedMotion::trace, nb::sig("def trace(self) -> list[numpy.ndarray]"),
              "All accepted iterates if `trace` was set, else empty.");

  m.def(
      "repulsive_force",
      [](const Cell& cell, const SearchMotion& motion, nb::handle others, const RepulsionSettings& settings) {
        require_motion(cell, motion);
        const auto held = held_motions(others, cell.single, motion.arm_index);
        std::vector<float> out;
        {
          nb::gil_scoped_release release;
          Repulsion<Floats>(settings).force(motion, held.read_only(), out);
        }
        const size_t dof = motion.arm->dof;
        return to_numpy<Out2>(rows_of(out), out.size() / dof, dof);
      },
      nb::arg("cell"), nb::arg("motion"), nb::arg("others"), nb::arg("settings"),
      nb::sig("def repulsive_force(cell: Cell, motion: Motion, others: collections.abc.Sequence[Motion], settings: "
              "RepulsionSettings) -> numpy.ndarray"),
      "Returns the joint forces J^T F [steps + 1, dof] of the field on a motion, zero at both ends.");

  m.def(
      "modify_motion",
      [](const Cell& cell, const SearchMotion& motion, nb::handle others, nb::handle constraints, Vector max_step_rad,
         const Levels<double>& levels, double constraint_margin, const RepulsionSettings& settings, const Clock& clock,
         bool trace) {
        require_motion(cell, motion);
        require_steps(cell, motion.arm_index, max_step_rad);
        const auto obstacles = held_motions(others, cell.single, motion.arm_index);
        const auto rules = held_constraints(constraints, motion.arm->dof);
        ModifyMotion<Floats>::Result result;
        {
          nb::gil_scoped_release release;
          ModifyMotion<Floats> descent(*cell.world_planning, settings);
          result = descent.run(motion, obstacles.read_only(), rules.items(), as<float>(max_step_rad).data(),
                               as_float(levels), float(checked_number(constraint_margin)), trace, clock);
        }
        const size_t dof = motion.arm->dof, rows = result.positions.size() / dof;
        nb::list iterates;
        for (auto& t : result.trace) iterates.append(to_numpy<Out2>(rows_of(t), rows, dof));
        return ModifiedMotion{nb::cast(to_numpy<Out2>(rows_of(result.positions), rows, dof)), result.moved,
                              result.iterations, result.input_breaks_constraint, iterates};
      },
      nb::arg("cell"), nb::arg("motion"), nb::kw_only(), nb::arg("others"), nb::arg("constraints"),
      nb::arg("max_step_rad"), nb::arg("levels"), nb::arg("constraint_margin"), nb::arg("settings"), nb::arg("clock"),
      nb::arg("trace") = false,
      nb::sig("def modify_motion(cell: Cell, motion: Motion, *, others: collections.abc.Sequence[Motion], constraints: "
              "collections.abc.Sequence[Constraint], max_step_rad: numpy.ndarray, levels: Levels, "
              "constraint_margin: float, settings: RepulsionSettings, clock: Clock, trace: bool = False) -> "
              "ModifiedMotion"),
      "Moves a motion away from the others along the repulsive force (ModifyMotion of APF-ECBS). `levels` hold against "
      "static bodies. A constraint is broken when surfaces come closer than `constraint_margin` [m] in its window.");

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
      "Returns whether a motion comes closer than `margin` [m] to a forbidden region within its window.");
}

}  // namespace mmp
