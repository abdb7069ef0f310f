#include "bindings.hpp"

namespace mmp {

namespace {

RepulsionOptions repulsion_options(double alpha, double k_rep, double d0, int max_iterations, bool centre_distance,
                                   bool normalised, double normalised_step, double max_step, double comfort) {
  return {alpha, k_rep, d0, max_iterations, centre_distance, normalised, normalised_step, max_step, comfort};
}

}  // namespace

void bind_search(nb::module_& m) {
  nb::class_<SearchMotion>(m, "Motion", "One arm's trajectory on the grid of steps, its spheres worked out.")
      .def(
          "__init__",
          [](SearchMotion* self, const Cell& cell, int arm, Matrix q) {
            need_rows(cell, arm, q);
            need(q.shape(0) > 0, "a motion has one step at least");
            nb::gil_scoped_release release;
            new (self) SearchMotion(cell.single, arm, {q.data(), q.data() + q.size()});
          },
          nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::keep_alive<1, 2>())
      .def_ro("arm", &SearchMotion::arm_index)
      .def_ro("last", &SearchMotion::last, "Index of the last step.");

  m.def(
      "conflict_instants",
      [](const Cell& cell, nb::handle motions, Pairs pairs, double margin, double proof, bool bases) {
        const auto held = held_motions(motions, cell.single);
        const auto& of = held.items();
        const int n = static_cast<int>(pairs.shape(0)), count = static_cast<int>(of.size());
        for (int k = 0; k < 2 * n; ++k) need(pairs.data()[k] >= 0 && pairs.data()[k] < count, "no such motion");
        std::vector<std::vector<double>> found(n);
        {
          nb::gil_scoped_release release;
          PairCheck<Floats> check(cell.world<Floats>(), bases);
          for (int k = 0; k < n; ++k)
            check(*of[pairs.data()[2 * k]], *of[pairs.data()[2 * k + 1]], levels_of(margin, proof), found[k]);
        }
        nb::list out;
        for (auto& steps : found) {
          const size_t size = steps.size();
          out.append(to_numpy<Out1>(std::move(steps), size));
        }
        return out;
      },
      nb::arg("cell"), nb::arg("motions"), nb::arg("pairs"), nb::arg("margin"), nb::arg("proof"),
      nb::arg("bases") = false,
      nb::sig(
          "def conflict_instants(cell: Cell, motions: collections.abc.Sequence[Motion], pairs: numpy.ndarray, margin: "
          "float, proof: float, bases: bool = False) -> list[numpy.ndarray]"),
      "For each pair of motions the instants of conflict, in steps, ascending: whole where surfaces are closer than "
      "`margin` [m] at a step, broken for a contact found between two. Elsewhere `proof` [m] is proved to be kept at "
      "every instant. A motion stays at its last step for ever. With `bases`, moving links against the other's base "
      "too.");

  nb::class_<SearchConstraint>(
      m, "Constraint",
      "What one arm must not do in the open window (start, end) of steps; where they are equal, at "
      "that one instant.")
      .def_static(
          "ball",
          [](Vector center, double radius, double start, double end) {
            need(center.shape(0) > 0 && center.shape(0) <= kMaxDof, "a configuration");
            return SearchConstraint::ball(as<float>(center), float(radius), window_of(start, end));
          },
          nb::arg("center"), nb::arg("radius"), nb::arg("start"), nb::arg("end"),
          "Being within `radius` [rad] of a configuration in every joint.")
      .def_static(
          "standing",
          [](const Cell& cell, int arm, Vector q, double shrink, double start, double end) {
            need_joints(cell, arm, q);
            return SearchConstraint::standing(cell.single.arms[arm], as<float>(q).data(), float(shrink),
                                              window_of(start, end));
          },
          nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("shrink"), nb::arg("start"), nb::arg("end"),
          nb::keep_alive<0, 1>(), "Touching another arm as it stands at q, its spheres smaller by `shrink` [m].")
      .def_static(
          "moving",
          [](nb::handle_t<SearchMotion> motion, double start, double end) {
            need(start == std::floor(start) && end == std::floor(end), "whole steps");
            const Window window = window_of(start, end);
            nb::list out;
            for (auto& part :
                 SearchConstraint::moving(nb::cast<const SearchMotion&>(motion), int(window.from), int(window.until))) {
              nb::object object = nb::cast(std::move(part));
              nb::keep_alive_obj(object, motion);
              out.append(object);
            }
            return out;
          },
          nb::arg("motion"), nb::arg("start"), nb::arg("end"),
          nb::sig("def moving(motion: Motion, start: float, end: float) -> list[Constraint]"),
          "Touching another arm as it moves, from step `start` to `end`: a list of constraints, one a step.")
      .def_static(
          "sphere",
          [](Vector center, double radius, int first_link, double start, double end) {
            need(center.shape(0) == 3 && first_link > 0, "a point, and a link that moves");
            return SearchConstraint::ball_in_space(as<float>(center).data(), float(radius), first_link,
                                                   window_of(start, end));
          },
          nb::arg("center"), nb::arg("radius"), nb::arg("first_link"), nb::arg("start"), nb::arg("end"),
          "Links from `first_link` on touching a sphere in the world.")
      .def_prop_ro("start", [](const SearchConstraint& c) { return c.window.from; })
      .def_prop_ro("end", [](const SearchConstraint& c) { return c.window.until; });

  m.def(
      "safe_intervals",
      [](const Cell& cell, int arm, Vector q, nb::handle constraints, double margin, double proof, nb::handle others) {
        need_joints(cell, arm, q);
        const auto rules = held_constraints(constraints, cell.single.arms[arm].dof);
        const auto movers = held_motions(others, cell.single, arm);
        std::vector<std::pair<int, int>> out;
        {
          nb::gil_scoped_release release;
          const std::vector<float> max_step(cell.single.arms[arm].dof, 1.0f), at = as<float>(q);
          const auto levels = levels_of(margin, proof);
          EdgeMaker<Floats> maker(cell.world<Floats>(), arm, rules.items(), levels, max_step.data(),
                                  Movers<Floats>(movers.read_only(), levels, 1.0f));
          std::vector<Window> windows;
          maker.standing(at.data(), windows);
          out = safe_intervals(std::move(windows));
        }
        std::vector<int32_t> flat;
        for (const auto& [lo, hi] : out) flat.insert(flat.end(), {lo, hi});
        return to_numpy<Windows>(flat, out.size(), 2);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("constraints"), nb::arg("margin"), nb::arg("proof"),
      nb::arg("others") = nb::make_tuple(),
      nb::sig("def safe_intervals(cell: Cell, arm: int, q: numpy.ndarray, constraints: "
              "collections.abc.Sequence[Constraint], margin: float, proof: float, others: "
              "collections.abc.Sequence[Motion] = ()) -> numpy.ndarray"),
      "Whole steps [lo, hi] between which the arm may stand at q, [m, 2]; the last may end at FOREVER. `others`: "
      "motions "
      "of other arms that `proof` [m] is kept from.");

  nb::class_<SearchArm>(m, "SingleArm",
                        "Plans one arm in space and time (SI-RRT*); keeps what does not depend on constraints.")
      .def(
          "__init__",
          [](SearchArm* self, const Cell& cell, int arm, Vector start, Vector goal, Vector max_step, double margin,
             double proof, uint64_t seed, double eta) {
            need_joints(cell, arm, start);
            need_joints(cell, arm, goal);
            need_joints(cell, arm, max_step);
            need(eta > 1e-3 && eta < 1e3, "eta must be a sensible angle");
            new (self) SearchArm(*cell.world_planning, arm, as<float>(start), as<float>(goal), as<float>(max_step),
                                 levels_of(margin, proof), float(eta), seed);
          },
          nb::arg("cell"), nb::arg("arm"), nb::arg("start"), nb::arg("goal"), nb::arg("max_step"), nb::arg("margin"),
          nb::arg("proof"), nb::arg("seed"), nb::arg("eta") = 0.8, nb::keep_alive<1, 2>())
      .def(
          "plan",
          [](SearchArm& self, nb::handle constraints, uint64_t seed, const Clock& clock, int max_iterations,
             int improve_iterations, int shortcuts, double goal_bias, int neighbours, nb::handle others,
             std::optional<Matrix> experience) -> std::pair<nb::object, int> {
            const auto rules = held_constraints(constraints, self.dof());
            const auto movers = held_motions(others, self.cell(), self.arm());
            std::vector<float> rows;
            if (experience) {
              need_configurations(*experience, self.dof());
              rows.assign(experience->data(), experience->data() + experience->size());
            }
            LowLevelPath<float> path;
            {
              nb::gil_scoped_release release;
              path = self.plan(rules.items(), movers.read_only(), rows,
                               {max_iterations, improve_iterations, shortcuts, goal_bias, neighbours}, seed, clock);
            }
            if (!path.found) return {nb::none(), path.iterations};
            const size_t dof = self.dof();
            return {nb::cast(to_numpy<Out2>(rows_of(path.positions), path.positions.size() / dof, dof)),
                    path.iterations};
          },
          nb::arg("constraints"), nb::arg("seed"), nb::arg("clock"), nb::arg("max_iterations") = 2000,
          nb::arg("improve_iterations") = 0, nb::arg("shortcuts") = 40, nb::arg("goal_bias") = 0.1,
          nb::arg("neighbours") = 6, nb::arg("others") = nb::make_tuple(), nb::arg("experience") = nb::none(),
          nb::sig("def plan(self, constraints: collections.abc.Sequence[Constraint], seed: int, clock: Clock, "
                  "max_iterations: int = 2000, improve_iterations: int = 0, shortcuts: int = 40, goal_bias: float = "
                  "0.1, neighbours: int = 6, others: collections.abc.Sequence[Motion] = (), experience: numpy.ndarray "
                  "| None = None) -> tuple[numpy.ndarray | None, int]"),
          "Configurations [steps + 1, dof] on the grid, or None, and the iterations that it took. `others`: motions of "
          "other arms, parked at their last step for ever, that the path is proved to keep clear of. `experience` [k, "
          "dof]: a path on the grid that the search begins with as far as it holds.");

  m.def(
      "repulsive_force",
      [](const Cell& cell, const SearchMotion& motion, nb::handle others, double k_rep, double d0,
         bool centre_distance) {
        need_motion(cell, motion);
        const auto held = held_motions(others, cell.single);
        std::vector<float> out;
        {
          nb::gil_scoped_release release;
          RepulsionOptions options;
          options.k_rep = k_rep;
          options.d0 = d0;
          options.centre_distance = centre_distance;
          Repulsion<Floats>(cell.world<Floats>(), options).force(motion, held.read_only(), out);
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
         double margin, double proof, double constraint_margin, const Clock& clock, double alpha, double k_rep,
         double d0, int max_iterations, bool centre_distance, bool normalised, double normalised_step, double max_step,
         double comfort, bool trace) {
        need_motion(cell, motion);
        need_joints(cell, motion.arm_index, max_step_rad);
        const auto movers = held_motions(others, cell.single);
        const auto rules = held_constraints(constraints, motion.arm->dof);
        Repulsion<Floats>::Result result;
        {
          nb::gil_scoped_release release;
          Repulsion<Floats> repulsion(*cell.world_planning,
                                      repulsion_options(alpha, k_rep, d0, max_iterations, centre_distance, normalised,
                                                        normalised_step, max_step, comfort));
          result = repulsion.modify(motion, movers.read_only(), rules.items(), as<float>(max_step_rad).data(),
                                    levels_of(margin, proof), float(constraint_margin), trace, clock);
        }
        const size_t dof = motion.arm->dof, rows = result.positions.size() / dof;
        nb::list steps;
        for (auto& t : result.trace) steps.append(to_numpy<Out2>(rows_of(t), rows, dof));
        return nb::make_tuple(to_numpy<Out2>(rows_of(result.positions), rows, dof), result.moved, result.iterations,
                              result.input_breaks_constraint, steps);
      },
      nb::arg("cell"), nb::arg("motion"), nb::arg("others"), nb::arg("constraints"), nb::arg("max_step_rad"),
      nb::arg("margin"), nb::arg("proof"), nb::arg("constraint_margin"), nb::arg("clock"), nb::arg("alpha"),
      nb::arg("k_rep"), nb::arg("d0"), nb::arg("max_iterations"), nb::arg("centre_distance"), nb::arg("normalised"),
      nb::arg("normalised_step"), nb::arg("max_step"), nb::arg("comfort"), nb::arg("trace") = false,
      nb::sig("def modify_motion(cell: Cell, motion: Motion, others: collections.abc.Sequence[Motion], constraints: "
              "collections.abc.Sequence[Constraint], max_step_rad: numpy.ndarray, margin: float, proof: float, "
              "constraint_margin: float, clock: Clock, alpha: float, k_rep: float, d0: float, max_iterations: int, "
              "centre_distance: bool, normalised: bool, normalised_step: float, max_step: float, comfort: float, "
              "trace: bool = False) -> tuple[numpy.ndarray, bool, int, bool, list[numpy.ndarray]]"),
      "ModifyMotion: (positions, moved, iterations, whether the input broke a constraint, iterates if traced).");

  m.def(
      "breaks_constraint",
      [](const Cell& cell, const SearchMotion& motion, nb::handle constraints, double margin) {
        need_motion(cell, motion);
        const auto rules = held_constraints(constraints, motion.arm->dof);
        nb::gil_scoped_release release;
        return Repulsion<Floats>(cell.world<Floats>(), {}).broken(motion, rules.items(), float(margin));
      },
      nb::arg("cell"), nb::arg("motion"), nb::arg("constraints"), nb::arg("margin"),
      nb::sig("def breaks_constraint(cell: Cell, motion: Motion, constraints: collections.abc.Sequence[Constraint], "
              "margin: float) -> bool"),
      "Whether a motion comes closer than `margin` [m] to what its constraints forbid, within their windows.");
}

}  // namespace mmp
