#include "bindings/bindings.hpp"

namespace mmp {

namespace {

void bind_search_settings(nb::module_& m) {
  using Settings = SingleArmSettings;
  const Settings defaults;
  nb::class_<Settings>(m, "SingleArmSettings", "Settings of one call of `SingleArm.plan`.")
      .def(
          "__init__",
          [](Settings* self, int max_iterations, int improve_iterations, int shortcuts, double goal_bias,
             int neighbours, bool direct, bool static_tree) {
            new (self) Settings{checked_count(max_iterations),
                                checked_count(improve_iterations),
                                checked_count(shortcuts),
                                checked_share(goal_bias),
                                checked_count(neighbours),
                                direct,
                                static_tree};
          },
          nb::kw_only(), nb::arg("max_iterations") = defaults.max_iterations,
          nb::arg("improve_iterations") = defaults.improve_iterations, nb::arg("shortcuts") = defaults.shortcuts,
          nb::arg("goal_bias") = defaults.goal_bias, nb::arg("neighbours") = defaults.neighbours,
          nb::arg("direct") = defaults.direct, nb::arg("static_tree") = defaults.static_tree)
      .def_ro("max_iterations", &Settings::max_iterations, "Largest number of iterations until the first path.")
      .def_ro("improve_iterations", &Settings::improve_iterations, "Iterations after the first path.")
      .def_ro("shortcuts", &Settings::shortcuts, "Attempts to shorten the path.")
      .def_ro("goal_bias", &Settings::goal_bias, "Share of samples at the goal.")
      .def_ro("neighbours", &Settings::neighbours, "Largest number of neighbours that a sample is connected to.")
      .def_ro("direct", &Settings::direct,
              "Whether paths that need no sampling are tried first: straight lines, and "
              "the branch of the static tree.")
      .def_ro("static_tree", &Settings::static_tree,
              "Whether the static goal tree is used: its branches, and samples of it.");
}

}  // namespace

void bind_single_arm(nb::module_& m) {
  m.attr("STEERING_RAD") = kSteering;
  bind_search_settings(m);

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
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("constraints"), nb::arg("levels"), nb::kw_only(),
      nb::arg("others") = nb::make_tuple(),
      nb::sig("def safe_intervals(cell: Cell, arm: int, q: numpy.ndarray, constraints: "
              "collections.abc.Sequence[Constraint], levels: Levels, *, others: "
              "collections.abc.Sequence[Motion] = ()) -> numpy.ndarray"),
      "Returns the safe intervals [m, 2] of a configuration, in whole steps [first, last]; the last one may end at "
      "FOREVER. `others`: motions of other arms, which stay `levels` away.");

  nb::class_<SearchArm>(m, "SingleArm",
                        "Planner of one arm in space and time (SI-RRT*). It keeps what does not depend on constraints.")
      .def(
          "__init__",
          [](SearchArm* self, const Cell& cell, int arm, Vector start, Matrix goals, Vector max_step,
             const Levels<double>& levels, uint64_t seed, double eta) {
            require_joints(cell, arm, start);
            require_rows(cell, arm, goals);
            require(goals.shape(0) > 0, "one goal at least is needed");
            require_steps(cell, arm, max_step);
            for (size_t k = 0; k < goals.shape(0); ++k)
              require_few_steps(start.data(), goals.data() + k * goals.shape(1), max_step);
            require(eta > 1e-3 && eta < 1e3, "eta must be between 1e-3 and 1e3 rad");
            new (self) SearchArm(*cell.world_planning, arm, as<float>(start), separate_rows<float>(goals),
                                 as<float>(max_step), as_float(levels), float(eta), seed);
          },
          nb::arg("cell"), nb::arg("arm"), nb::kw_only(), nb::arg("start"), nb::arg("goals"), nb::arg("max_step"),
          nb::arg("levels"), nb::arg("seed"), nb::arg("eta") = kSteering, nb::keep_alive<1, 2>(),
          "`goals` [n, dof]: a path may end at any of them. `max_step` [dof]: largest move of each joint in one step "
          "[rad]; `eta`: steering distance [rad].")
      .def(
          "plan",
          [](SearchArm& self, nb::handle constraints, uint64_t seed, const Clock& clock,
             const SingleArmSettings& settings, nb::handle others,
             std::optional<Matrix> experience) -> std::pair<nb::object, int> {
            const auto rules = held_constraints(constraints, self.dof());
            const auto obstacles = held_motions(others, self.cell(), self.arm());
            std::vector<float> rows;
            if (experience) {
              require_configurations(*experience, self.dof());
              rows.assign(experience->data(), experience->data() + experience->size());
            }
            SingleArmPath<float> path;
            {
              nb::gil_scoped_release release;
              path = self.plan(rules.items(), obstacles.read_only(), rows, settings, seed, clock);
            }
            if (!path.found) return {nb::none(), path.iterations};
            const size_t dof = self.dof();
            return {nb::cast(to_numpy<Out2>(rows_of(path.positions), path.positions.size() / dof, dof)),
                    path.iterations};
          },
          nb::arg("constraints"), nb::arg("seed"), nb::arg("clock"), nb::kw_only(),
          nb::arg("settings") = SingleArmSettings{}, nb::arg("others") = nb::make_tuple(),
          nb::arg("experience") = nb::none(),
          nb::sig("def plan(self, constraints: collections.abc.Sequence[Constraint], seed: int, clock: Clock, *, "
                  "settings: SingleArmSettings = ..., others: collections.abc.Sequence[Motion] = (), "
                  "experience: numpy.ndarray | None = None) -> tuple[numpy.ndarray | None, int]"),
          "Returns a trajectory [steps + 1, dof] on the grid, or None, and the number of iterations. The trajectory is "
          "proved clear of `others`, motions of other arms that stay at their last step. `experience` [k, dof]: "
          "earlier trajectory that the search starts from.");

  m.def(
      "search_tree",
      [](SearchArm& arm, nb::handle others, uint64_t seed, const Clock& clock, int iterations) {
        const auto obstacles = held_motions(others, arm.cell(), arm.arm());
        SingleArmSettings settings;
        settings.max_iterations = settings.improve_iterations = checked_count(iterations);
        TreeSnapshot<float> snapshot;
        SingleArmPath<float> path;
        {
          nb::gil_scoped_release release;
          path = arm.plan({}, obstacles.read_only(), {}, settings, seed, clock, &snapshot);
        }
        const size_t dof = arm.dof(), count = snapshot.links.size() / 2;
        nb::object found = nb::none();
        if (path.found) found = nb::cast(to_numpy<Out2>(rows_of(path.positions), path.positions.size() / dof, dof));
        return nb::make_tuple(to_numpy<Out2>(rows_of(snapshot.positions), count, dof),
                              to_numpy<Windows>(snapshot.links, count, 2), found);
      },
      nb::arg("arm"), nb::kw_only(), nb::arg("others"), nb::arg("seed"), nb::arg("clock"), nb::arg("iterations"),
      nb::sig("def search_tree(arm: SingleArm, *, others: collections.abc.Sequence[Motion], seed: int, clock: Clock, "
              "iterations: int) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray | None]"),
      "Returns a snapshot of the tree that SI-RRT* grows among `others`: configurations [v, dof], the arrival step and "
      "the parent vertex of each [v, 2] (-1: none), and the path, or None.");
}

}  // namespace mmp
