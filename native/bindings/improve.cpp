#include "bindings/bindings.hpp"
#include "improve/path_recombination.hpp"
#include "improve/replanner.hpp"
#include "improve/shortcutting.hpp"

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

// Joint motion on one grid of steps, as Python passes it.
struct JointMotion {
  std::vector<std::vector<float>> rows, max_step;

  JointMotion(const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& steps) {
    const size_t arms = cell.single.arms.size();
    require(arms > 0 && q.size() == arms && steps.size() == arms, "one array for each arm");
    for (size_t a = 0; a < arms; ++a) {
      require_rows(cell, static_cast<int>(a), q[a]);
      require(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "as many rows for each arm");
      rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
    }
    max_step = steps_of(cell, steps);
    for (size_t a = 0; a < arms; ++a)
      require_few_steps(q[a].data(), q[a].data() + q[a].size() - steps[a].size(), steps[a]);
  }

  // Returns the result of `improve`, [steps + 1][dof] per arm, and the number of improvements.
  template <class Improve>
  static nb::tuple improved(const Cell& cell, const Improve& improve) {
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
    return nb::make_tuple(out, kept);
  }
};

}  // namespace

void bind_improve(nb::module_& m) {
  m.def(
      "shorten",
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_step,
         const Levels<double>& levels, const std::vector<int>& groups, int attempts, double worth, uint64_t seed,
         const Clock& clock) {
        const JointMotion motion(cell, q, max_step);
        require(groups.size() == q.size(), "a group for each arm");
        require(worth > 0, "worth must be positive");
        checked_count(attempts);
        return motion.improved(cell, [&](std::vector<std::vector<double>>& found) {
          Shortcutter<Floats> shortcutter(cell.world<Floats>(), motion.rows, motion.max_step, as_float(levels), groups);
          Random random(seed);
          const int kept = shortcutter.run(attempts, worth, random, clock);
          for (size_t a = 0; a < q.size(); ++a) found.push_back(rows_of(shortcutter.rows(static_cast<int>(a))));
          return kept;
        });
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("max_step"), nb::arg("levels"), nb::arg("groups"), nb::arg("attempts"),
      nb::arg("worth"), nb::arg("seed"), nb::arg("clock"),
      nb::sig("def shorten(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], max_step: "
              "collections.abc.Sequence[numpy.ndarray], levels: Levels, groups: "
              "collections.abc.Sequence[int], attempts: int, worth: float, seed: int, clock: Clock) -> "
              "tuple[list[numpy.ndarray], int]"),
      "Shortcuts on the common clock: q [steps + 1, dof] per arm of a safe plan; returns the shorter one and the "
      "number of windows that were replaced. `levels` are proved of one arm and of pairs at every "
      "instant; arms of different `groups` pass through each other. As many attempts again as long as they shorten the "
      "ways by a share `worth`.");

  m.def(
      "replan",
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_step,
         const Levels<double>& levels, int attempts, uint64_t seed, const Clock& clock) {
        const JointMotion motion(cell, q, max_step);
        checked_count(attempts);
        return motion.improved(cell, [&](std::vector<std::vector<double>>& found) {
          Replanner<Floats> replanner(*cell.world_planning, motion.rows, motion.max_step, as_float(levels));
          Random random(seed);
          const int kept = replanner.run(attempts, random, clock);
          for (size_t a = 0; a < q.size(); ++a) found.push_back(rows_of(replanner.rows(static_cast<int>(a))));
          return kept;
        });
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("max_step"), nb::arg("levels"), nb::arg("attempts"), nb::arg("seed"),
      nb::arg("clock"),
      nb::sig("def replan(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], max_step: "
              "collections.abc.Sequence[numpy.ndarray], levels: Levels, attempts: int, seed: int, clock: "
              "Clock) -> tuple[list[numpy.ndarray], int]"),
      "Shorter ways of single arms, for which another one may make room: q [steps + 1, dof] per arm of a safe plan; "
      "returns the shorter one and the number of attempts that succeeded. `levels` are proved of every new way.");

  using Pool = PathRecombination<Floats>;
  nb::class_<Pool>(m, "Recombination", "Ways of several plans, put together anew. For one thread at a time.")
      .def(
          "__init__",
          [](Pool* self, const Cell& cell, const std::vector<Vector>& max_step, const Levels<double>& levels) {
            require_frozen(cell);
            require(max_step.size() == cell.single.arms.size() && !max_step.empty(), "one array for each arm");
            new (self) Pool(*cell.world_planning, steps_of(cell, max_step), as_float(levels));
          },
          nb::arg("cell"), nb::arg("max_step"), nb::arg("levels"), nb::keep_alive<1, 2>(),
          nb::sig("def __init__(self, cell: Cell, max_step: collections.abc.Sequence[numpy.ndarray], "
                  "levels: Levels) -> None"))
      .def(
          "add",
          [](Pool& self, const std::vector<Matrix>& q) {
            require(q.size() == self.cell().arms.size(), "one array for each arm");
            std::vector<std::vector<float>> rows;
            for (size_t a = 0; a < q.size(); ++a) {
              require_configurations(q[a], self.cell().arms[a].dof);
              require(q[a].shape(0) > 0, "a way has rows");
              rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
            }
            nb::gil_scoped_release release;
            return self.add(rows);
          },
          nb::arg("q"), nb::sig("def add(self, q: collections.abc.Sequence[numpy.ndarray]) -> list[int]"),
          "A way [n, dof] for each arm from its start to its goal, free alone, on a grid of steps. Returns the numbers "
          "of the ways that stand for them, -1 where one was not taken.")
      .def("has", &Pool::has, nb::arg("choice"),
           nb::sig("def has(self, choice: collections.abc.Sequence[int]) -> bool"),
           "Whether there is a way with such a number for each arm; one may have had to go for a shorter one.")
      .def("shortest", &Pool::shortest, "The number of the shortest way of each arm.")
      .def(
          "way",
          [](const Pool& self, int arm, int number) {
            require(arm >= 0 && arm < self.arms(), "no such arm");
            const auto* motion = self.path(arm, number);
            require(motion != nullptr, "no such way");
            return to_numpy<Out2>(rows_of(motion->q), static_cast<size_t>(motion->last) + 1, motion->arm->dof);
          },
          nb::arg("arm"), nb::arg("number"), nb::sig("def way(self, arm: int, number: int) -> numpy.ndarray"),
          "A way [steps + 1, dof] in as few steps as full speed allows.")
      .def(
          "closed",
          [](Pool& self, const std::vector<int>& choice, const Clock& clock) {
            require(self.has(choice), "a way for each arm");
            nb::gil_scoped_release release;
            return self.infeasible_pairs(choice, clock);
          },
          nb::arg("choice"), nb::arg("clock"),
          nb::sig("def closed(self, choice: collections.abc.Sequence[int], clock: Clock) -> list[tuple[int, int]]"),
          "Pairs of arms that cannot both come to their ends on the ways with these numbers, whoever waits for whom; "
          "those "
          "found until the clock ends.")
      .def(
          "run",
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
          nb::sig("def run(self, limit: float, clock: Clock) -> list[numpy.ndarray] | None"),
          "Motions [steps + 1, dof] per arm along ways that are shorter than `limit` [rad] together, or None if no "
          "choice of them can be drive_rows at once that was not given before. `levels` are proved of every pair.");
}

}  // namespace mmp
