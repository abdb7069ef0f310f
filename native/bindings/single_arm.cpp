#include "bindings/bindings.hpp"

namespace mmp {

void bind_single_arm(nb::module_& m) {
  m.def(
      "safe_intervals",
      [](const Cell& cell, int arm, Vector q, nb::handle constraints, const Levels<double>& given, nb::handle others) {
        require_joints(cell, arm, q);
        const auto rules = held_constraints(constraints, cell.single.arms[arm].dof);
        const auto obstacles = held_motions(others, cell.single, arm);
        std::vector<std::pair<int, int>> out;
        {
          nb::gil_scoped_release release;
          const std::vector<float> max_step(cell.single.arms[arm].dof, 1.0f), at = as<float>(q);
          const auto levels = as_float(given);
          EdgeChecker<Floats> checker(cell.world<Floats>(), arm, rules.items(), levels, max_step.data(),
                                      DynamicObstacles<Floats>(obstacles.read_only(), levels, 1.0f));
          std::vector<Window> windows;
          checker.standing(at.data(), windows);
          out = safe_intervals(std::move(windows));
        }
        std::vector<int32_t> flat;
        for (const auto& [lo, hi] : out) flat.insert(flat.end(), {lo, hi});
        return to_numpy<Windows>(flat, out.size(), 2);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("constraints"), nb::arg("levels"),
      nb::arg("others") = nb::make_tuple(),
      nb::sig("def safe_intervals(cell: Cell, arm: int, q: numpy.ndarray, constraints: "
              "collections.abc.Sequence[Constraint], levels: Levels, others: "
              "collections.abc.Sequence[Motion] = ()) -> numpy.ndarray"),
      "Whole steps [lo, hi] between which the arm may stand at q, [m, 2]; the last may end at FOREVER. `others`: "
      "motions "
      "of other arms that `levels` are kept from.");

  nb::class_<SearchArm>(m, "SingleArm",
                        "Plans one arm in space and time (SI-RRT*); keeps what does not depend on constraints.")
      .def(
          "__init__",
          [](SearchArm* self, const Cell& cell, int arm, Vector start, Vector goal, Vector max_step,
             const Levels<double>& levels, uint64_t seed, double eta) {
            require_joints(cell, arm, start);
            require_joints(cell, arm, goal);
            require_steps(cell, arm, max_step);
            require_few_steps(start.data(), goal.data(), max_step);
            require(eta > 1e-3 && eta < 1e3, "eta must be a sensible angle");
            new (self) SearchArm(*cell.world_planning, arm, as<float>(start), as<float>(goal), as<float>(max_step),
                                 as_float(levels), float(eta), seed);
          },
          nb::arg("cell"), nb::arg("arm"), nb::arg("start"), nb::arg("goal"), nb::arg("max_step"), nb::arg("levels"),
          nb::arg("seed"), nb::arg("eta") = 0.8, nb::keep_alive<1, 2>())
      .def(
          "plan",
          [](SearchArm& self, nb::handle constraints, uint64_t seed, const Clock& clock, int max_iterations,
             int improve_iterations, int shortcuts, double goal_bias, int neighbours, nb::handle others,
             std::optional<Matrix> experience) -> std::pair<nb::object, int> {
            const auto rules = held_constraints(constraints, self.dof());
            const auto obstacles = held_motions(others, self.cell(), self.arm());
            const LowLevelOptions options{checked_count(max_iterations), checked_count(improve_iterations),
                                          checked_count(shortcuts), checked_share(goal_bias),
                                          checked_count(neighbours)};
            std::vector<float> rows;
            if (experience) {
              require_configurations(*experience, self.dof());
              rows.assign(experience->data(), experience->data() + experience->size());
            }
            LowLevelPath<float> path;
            {
              nb::gil_scoped_release release;
              path = self.plan(rules.items(), obstacles.read_only(), rows, options, seed, clock);
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
      "search_tree",
      [](SearchArm& arm, nb::handle others, uint64_t seed, const Clock& clock, int iterations) {
        const auto obstacles = held_motions(others, arm.cell(), arm.arm());
        LowLevelOptions options;
        options.max_iterations = options.improve_iterations = checked_count(iterations);
        TreeSnapshot<float> snapshot;
        LowLevelPath<float> path;
        {
          nb::gil_scoped_release release;
          path = arm.plan({}, obstacles.read_only(), {}, options, seed, clock, &snapshot);
        }
        const size_t dof = arm.dof(), count = snapshot.links.size() / 2;
        nb::object found = nb::none();
        if (path.found) found = nb::cast(to_numpy<Out2>(rows_of(path.positions), path.positions.size() / dof, dof));
        return nb::make_tuple(to_numpy<Out2>(rows_of(snapshot.positions), count, dof),
                              to_numpy<Windows>(snapshot.links, count, 2), found);
      },
      nb::arg("arm"), nb::arg("others"), nb::arg("seed"), nb::arg("clock"), nb::arg("iterations"),
      nb::sig("def search_tree(arm: SingleArm, others: collections.abc.Sequence[Motion], seed: int, clock: Clock, "
              "iterations: int) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray | None]"),
      "The tree that SI-RRT* has grown among `others` after so many iterations, whether it has found a path or not: "
      "configurations [v, dof], the step of arrival and the vertex before each [v, 2] (-1: none), and the path.");
}

}  // namespace mmp
