#include "bindings/bindings.hpp"
#include "improve/path_recombination.hpp"
#include "improve/replanner.hpp"
#include "improve/shortcutting.hpp"
#include "improve/wait_removal.hpp"

namespace mmp {

namespace {

// Largest move of each joint of each arm in one step.
std::vector<std::vector<float>> steps_of(const Cell& cell, const std::vector<Vector>& steps) {
  std::vector<std::vector<float>> out;
  for (size_t a = 0; a < steps.size(); ++a) {
    require_steps(cell, static_cast<int>(a), steps[a]);
    out.push_back(as<float>(steps[a]));
  }
  return out;
}

// Goals of each arm.
std::vector<std::vector<std::vector<float>>> goals_of(const Cell& cell, const std::vector<Matrix>& goals) {
  require(goals.size() == cell.single.arms.size(), "one array of goals per arm is needed");
  std::vector<std::vector<std::vector<float>>> out;
  for (size_t a = 0; a < goals.size(); ++a) {
    require_rows(cell, static_cast<int>(a), goals[a]);
    out.push_back(separate_rows<float>(goals[a]));
  }
  return out;
}

// Joint motion on one grid of steps, as Python passes it.
struct JointMotion {
  std::vector<std::vector<float>> rows, max_step;

  JointMotion(const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& steps) {
    require_frozen(cell);
    const size_t arms = cell.single.arms.size();
    require(arms > 0 && q.size() == arms && steps.size() == arms, "one array per arm is needed");
    for (size_t a = 0; a < arms; ++a) {
      require_rows(cell, static_cast<int>(a), q[a]);
      require(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "every arm needs the same number of rows");
      rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
    }
    max_step = steps_of(cell, steps);
    for (size_t a = 0; a < arms; ++a)
      require_few_steps(q[a].data(), q[a].data() + q[a].size() - steps[a].size(), steps[a]);
  }

  // Returns the result of `improve`, [steps + 1][dof] per arm, and the number of improvements.
  template <class Improve>
  static std::pair<nb::list, int> improved(const Cell& cell, const Improve& improve) {
    std::vector<std::vector<double>> found;
    int kept = 0;
    {
      nb::gil_scoped_release release;
      kept = improve(found);
    }
    nb::list out;
    for (size_t a = 0; a < found.size(); ++a) {
      const size_t dof = static_cast<size_t>(cell.single.arms[a].dof), n = found[a].size() / dof;
      out.append(to_numpy<Out2>(std::move(found[a]), n, dof));
    }
    return {out, kept};
  }
};

}  // namespace

void bind_improve(nb::module_& m) {
  using Settings = ShortcutSettings;
  nb::class_<Settings>(m, "ShortcutSettings", "Settings of `shortcut`.")
      .def(
          "__init__",
          [](Settings* self, int attempts, double min_saving) {
            require(min_saving > 0, "min_saving must be positive");
            new (self) Settings{checked_count(attempts), min_saving};
          },
          nb::kw_only(), nb::arg("attempts"), nb::arg("min_saving") = Settings{}.min_saving,
          nb::sig("def __init__(self, *, attempts: int, min_saving: float = ...) -> None"))
      .def_ro("attempts", &Settings::attempts, "Attempts per round.")
      .def_ro("min_saving", &Settings::min_saving,
              "Minimum relative saving of a round for another round; infinity, the default: one round.");

  m.def(
      "shortcut",
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_step,
         const std::vector<Matrix>& goals, const Levels<double>& levels, const std::vector<int>& groups,
         const Settings& settings, uint64_t seed, const Clock& clock) {
        const JointMotion motion(cell, q, max_step);
        const auto ends = goals_of(cell, goals);
        require(groups.size() == q.size(), "one group per arm is needed");
        return motion.improved(cell, [&](std::vector<std::vector<double>>& found) {
          Shortcutter<Floats> shortcutter(cell.world<Floats>(), motion.rows, ends, motion.max_step, as_float(levels),
                                          groups);
          Random random(seed);
          const int kept = shortcutter.run(settings, random, clock);
          for (size_t a = 0; a < q.size(); ++a) found.push_back(rows_of(shortcutter.rows(static_cast<int>(a))));
          return kept;
        });
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("max_step"), nb::kw_only(), nb::arg("goals"), nb::arg("levels"),
      nb::arg("groups"), nb::arg("settings"), nb::arg("seed"), nb::arg("clock"),
      nb::sig("def shortcut(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], max_step: "
              "collections.abc.Sequence[numpy.ndarray], *, goals: collections.abc.Sequence[numpy.ndarray], levels: "
              "Levels, groups: collections.abc.Sequence[int], settings: ShortcutSettings, seed: int, clock: Clock) "
              "-> tuple[list[numpy.ndarray], int]"),
      "Shortens a safe plan q [steps + 1, dof] per arm on the common clock. `goals` [n, dof] per arm: where it may "
      "end. "
      "Returns the shorter plan and the number of replaced motion windows. `levels` are proved for every arm and every "
      "pair at every instant. Arms in different "
      "`groups` ignore each other.");

  m.def(
      "replan",
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_step,
         const std::vector<Matrix>& goals, const Levels<double>& levels, int attempts, uint64_t seed,
         const Clock& clock) {
        const JointMotion motion(cell, q, max_step);
        const auto ends = goals_of(cell, goals);
        checked_count(attempts);
        return motion.improved(cell, [&](std::vector<std::vector<double>>& found) {
          Replanner<Floats> replanner(*cell.world_planning, motion.rows, ends, motion.max_step, as_float(levels));
          Random random(seed);
          const int kept = replanner.run(attempts, random, clock);
          for (size_t a = 0; a < q.size(); ++a) found.push_back(rows_of(replanner.rows(static_cast<int>(a))));
          return kept;
        });
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("max_step"), nb::kw_only(), nb::arg("goals"), nb::arg("levels"),
      nb::arg("attempts"), nb::arg("seed"), nb::arg("clock"),
      nb::sig("def replan(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], max_step: "
              "collections.abc.Sequence[numpy.ndarray], *, goals: collections.abc.Sequence[numpy.ndarray], levels: "
              "Levels, attempts: int, seed: int, clock: Clock) -> tuple[list[numpy.ndarray], int]"),
      "Large-neighbourhood search: replans one arm of a safe plan q [steps + 1, dof] per arm, or two if another must "
      "make room. `goals` [n, dof] per arm: where it may end. Returns the shorter plan and the number of successful "
      "attempts. `levels` are proved for every new path.");

  m.def(
      "remove_waits",
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_velocity, double distance,
         const Clock& clock) -> nb::object {
        require_frozen(cell);
        const size_t arms = cell.single.arms.size();
        require(arms > 0 && q.size() == arms && max_velocity.size() == arms, "one array per arm is needed");
        WaitRemoval<Floats>::Rows rows, velocities, found;
        for (size_t a = 0; a < arms; ++a) {
          require_rows(cell, static_cast<int>(a), q[a]);
          require_steps(cell, static_cast<int>(a), max_velocity[a]);
          require(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "every arm needs the same number of rows");
          rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
          velocities.emplace_back(max_velocity[a].data(), max_velocity[a].data() + max_velocity[a].size());
        }
        const auto least = static_cast<float>(checked_number(distance));
        {
          nb::gil_scoped_release release;
          found = WaitRemoval<Floats>(cell.single, rows, velocities, least, clock).run(clock);
        }
        if (found.empty()) return nb::none();
        nb::list out;
        for (size_t a = 0; a < arms; ++a) {
          const size_t dof = static_cast<size_t>(cell.single.arms[a].dof), n = found[a].size() / dof;
          out.append(to_numpy<Out2>(std::move(found[a]), n, dof));
        }
        return out;
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("max_velocity"), nb::kw_only(), nb::arg("distance"), nb::arg("clock"),
      nb::sig("def remove_waits(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], max_velocity: "
              "collections.abc.Sequence[numpy.ndarray], *, distance: float, clock: Clock) -> list[numpy.ndarray] | "
              "None"),
      "Lets every arm of a plan q [n, dof] move as soon as those that pass before it let it. Paths and order stay. "
      "Steps whose swept volumes keep `distance` [m] may take place at any times. Returns the configurations [m, dof] "
      "of each arm at new common times; None without time.");

  using Pool = PathRecombination<Floats>;
  nb::class_<Pool>(
      m, "PathRecombination",
      "Pool of known paths per arm, and combinations of them. Not safe for use by several threads at once.")
      .def(
          "__init__",
          [](Pool* self, const Cell& cell, const std::vector<Vector>& max_step, const Levels<double>& levels) {
            require_frozen(cell);
            require(max_step.size() == cell.single.arms.size() && !max_step.empty(), "one array per arm is needed");
            new (self) Pool(*cell.world_planning, steps_of(cell, max_step), as_float(levels));
          },
          nb::arg("cell"), nb::arg("max_step"), nb::arg("levels"), nb::keep_alive<1, 2>(),
          nb::sig("def __init__(self, cell: Cell, max_step: collections.abc.Sequence[numpy.ndarray], "
                  "levels: Levels) -> None"),
          "`max_step` [dof] per arm: largest move of each joint in one step [rad]. `levels` hold between arms.")
      .def(
          "add",
          [](Pool& self, const std::vector<Matrix>& q) {
            require(q.size() == self.cell().arms.size(), "one array per arm is needed");
            std::vector<std::vector<float>> rows;
            for (size_t a = 0; a < q.size(); ++a) {
              require_configurations(q[a], self.cell().arms[a].dof);
              require(q[a].shape(0) > 0, "a path needs one row at least");
              rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
            }
            nb::gil_scoped_release release;
            return self.add(rows);
          },
          nb::arg("q"), nb::sig("def add(self, q: collections.abc.Sequence[numpy.ndarray]) -> list[int]"),
          "Adds one path [n, dof] per arm on a grid of steps, free alone, from its start to its goal. Evicts the "
          "longest path when the pool is full. Returns path ids, or -1 for a path that was not added.")
      .def("has", &Pool::has, nb::arg("path_ids"),
           nb::sig("def has(self, path_ids: collections.abc.Sequence[int]) -> bool"),
           "Returns whether the pool holds these paths, one per arm.")
      .def("shortest", &Pool::shortest, "Returns the id of the shortest path of each arm, -1 for an arm without paths.")
      .def(
          "path",
          [](const Pool& self, int arm, int path_id) {
            require(arm >= 0 && arm < self.arms(), "no such arm");
            const auto* motion = self.path(arm, path_id);
            require(motion != nullptr, "no such path");
            return to_numpy<Out2>(rows_of(motion->q), static_cast<size_t>(motion->last) + 1, motion->arm->dof);
          },
          nb::arg("arm"), nb::arg("path_id"), nb::sig("def path(self, arm: int, path_id: int) -> numpy.ndarray"),
          "Returns a path [steps + 1, dof] in as few steps as full speed allows.")
      .def(
          "infeasible_pairs",
          [](Pool& self, const std::vector<int>& path_ids, const Clock& clock) {
            require(self.has(path_ids), "one path per arm is needed");
            nb::gil_scoped_release release;
            return self.infeasible_pairs(path_ids, clock);
          },
          nb::arg("path_ids"), nb::arg("clock"),
          nb::sig("def infeasible_pairs(self, path_ids: collections.abc.Sequence[int], clock: Clock) -> "
                  "list[tuple[int, int]]"),
          "Returns the pairs of arms whose paths have an infeasible coordination diagram: no schedule takes both arms "
          "to their ends. When the clock ends, returns the pairs found so far.")
      .def(
          "recombine",
          [](Pool& self, double limit, const Clock& clock) -> nb::object {
            require(!std::isnan(limit), "limit must be a number");
            Pool::Rows found;
            {
              nb::gil_scoped_release release;
              found = self.recombine(limit, clock);
            }
            if (found.empty()) return nb::none();
            nb::list out;
            for (size_t a = 0; a < found.size(); ++a) {
              const size_t dof = static_cast<size_t>(self.cell().arms[a].dof), n = found[a].size() / dof;
              out.append(to_numpy<Out2>(rows_of(found[a]), n, dof));
            }
            return out;
          },
          nb::arg("limit"), nb::arg("clock"),
          nb::sig("def recombine(self, limit: float, clock: Clock) -> list[numpy.ndarray] | None"),
          "Returns trajectories [steps + 1, dof] per arm along a combination of paths with total length below `limit` "
          "[rad], proved clear of each other, or None. Never returns a combination twice.");
}

}  // namespace mmp
