#include "bindings.hpp"
#include "composite.hpp"
#include "recombination.hpp"
#include "replanner.hpp"
#include "shortcut.hpp"

namespace mmp {

namespace {

using Search = CompositeSearch<Floats>;

void need_all_joints(const Cell& cell, const Vector& q) {
  need_frozen(cell);
  size_t dof = 0;
  for (const auto& arm : cell.single.arms) dof += static_cast<size_t>(arm.dof);
  need(q.shape(0) == dof, "wrong number of joints");
  need(all_within(q.data(), q.size(), kMostJoint), "a configuration must be finite, and within 1e4 rad");
}

// How far each joint of each arm may go in a step.
std::vector<std::vector<float>> steps_of(const Cell& cell, const std::vector<Vector>& steps) {
  std::vector<std::vector<float>> out;
  for (size_t a = 0; a < steps.size(); ++a) {
    need_steps(cell, static_cast<int>(a), steps[a]);
    out.push_back(as<float>(steps[a]));
  }
  return out;
}

// All arms on one grid of steps, as it comes from Python.
struct JointMotion {
  std::vector<std::vector<float>> rows, max_step;

  JointMotion(const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& steps) {
    const size_t arms = cell.single.arms.size();
    need(arms > 0 && q.size() == arms && steps.size() == arms, "one array for each arm");
    for (size_t a = 0; a < arms; ++a) {
      need_rows(cell, static_cast<int>(a), q[a]);
      need(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "as many rows for each arm");
      rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
    }
    max_step = steps_of(cell, steps);
    for (size_t a = 0; a < arms; ++a)
      need_few_steps(q[a].data(), q[a].data() + q[a].size() - steps[a].size(), steps[a]);
  }

  // What `improve` makes of it, [steps + 1][dof] per arm, and how often it made it better.
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

void bind_joint(nb::module_& m) {
  nb::class_<Search>(m, "CompositeSearch", "RRT-Connect in the space of all joints of all arms; can be asked to go on.")
      .def(
          "__init__",
          [](Search* self, const Cell& cell, Vector start, Vector goal, const Levels<double>& samples,
             const Levels<double>& edges, double range, double step, uint64_t seed) {
            need_all_joints(cell, start);
            need_all_joints(cell, goal);
            need(range >= 1e-3 && step >= 1e-4, "range and step must be 1e-3 and 1e-4 rad at least");
            checked_number(range);
            checked_number(step);
            new (self) Search(cell.world<Floats>(), as<float>(start), as<float>(goal), as_float(samples),
                              as_float(edges), {range, step}, seed);
          },
          nb::arg("cell"), nb::arg("start"), nb::arg("goal"), nb::arg("samples"), nb::arg("edges"), nb::arg("range"),
          nb::arg("step"), nb::arg("seed"), nb::keep_alive<1, 2>(),
          "`samples`: margins of the states looked at along an edge; `edges`: of a path that was found.")
      .def(
          "grow",
          [](Search& self, int iterations, const Clock& clock) -> nb::object {
            checked_count(iterations);
            std::vector<double> rows;
            size_t n = 0;
            {
              nb::gil_scoped_release release;
              const auto way = self.grow(iterations, clock);
              n = way.size();
              for (const float* q : way) rows.insert(rows.end(), q, q + self.dof());
            }
            if (n == 0) return nb::none();
            return nb::cast(to_numpy<Out2>(std::move(rows), n, self.dof()));
          },
          nb::arg("iterations"), nb::arg("clock"),
          nb::sig("def grow(self, iterations: int, clock: Clock) -> numpy.ndarray | None"),
          "A way [n, all joints], proved at every instant, or None if that many more iterations found none.")
      .def_prop_ro("iterations", &Search::iterations, "Iterations so far.")
      .def_prop_ro("nodes", &Search::nodes, "Nodes of both trees.");

  m.def(
      "shorten",
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_step,
         const Levels<double>& levels, const std::vector<int>& groups, int attempts, double worth, uint64_t seed,
         const Clock& clock) {
        const JointMotion motion(cell, q, max_step);
        need(groups.size() == q.size(), "a group for each arm");
        need(worth > 0, "worth must be positive");
        checked_count(attempts);
        return motion.improved(cell, [&](std::vector<std::vector<double>>& found) {
          Shortener<Floats> shortener(cell.world<Floats>(), motion.rows, motion.max_step, as_float(levels), groups);
          Random random(seed);
          const int kept = shortener.run(attempts, worth, random, clock);
          for (size_t a = 0; a < q.size(); ++a) found.push_back(rows_of(shortener.rows(static_cast<int>(a))));
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
      "number of stretches that were replaced. `levels` are proved of one arm and of pairs at every "
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

  using Anew = Recombination<Floats>;
  nb::class_<Anew>(m, "Recombination", "Ways of several plans, put together anew. For one thread at a time.")
      .def(
          "__init__",
          [](Anew* self, const Cell& cell, const std::vector<Vector>& max_step, const Levels<double>& levels) {
            need_frozen(cell);
            need(max_step.size() == cell.single.arms.size() && !max_step.empty(), "one array for each arm");
            new (self) Anew(*cell.world_planning, steps_of(cell, max_step), as_float(levels));
          },
          nb::arg("cell"), nb::arg("max_step"), nb::arg("levels"), nb::keep_alive<1, 2>(),
          nb::sig("def __init__(self, cell: Cell, max_step: collections.abc.Sequence[numpy.ndarray], "
                  "levels: Levels) -> None"))
      .def(
          "add",
          [](Anew& self, const std::vector<Matrix>& q) {
            need(q.size() == self.cell().arms.size(), "one array for each arm");
            std::vector<std::vector<float>> rows;
            for (size_t a = 0; a < q.size(); ++a) {
              need_configurations(q[a], self.cell().arms[a].dof);
              need(q[a].shape(0) > 0, "a way has rows");
              rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
            }
            nb::gil_scoped_release release;
            return self.add(rows);
          },
          nb::arg("q"), nb::sig("def add(self, q: collections.abc.Sequence[numpy.ndarray]) -> list[int]"),
          "A way [n, dof] for each arm from its start to its goal, free alone, on a grid of steps. Returns the numbers "
          "of the ways that stand for them, -1 where one was not taken.")
      .def("has", &Anew::has, nb::arg("choice"),
           nb::sig("def has(self, choice: collections.abc.Sequence[int]) -> bool"),
           "Whether there is a way with such a number for each arm; one may have had to go for a shorter one.")
      .def("shortest", &Anew::shortest, "The number of the shortest way of each arm.")
      .def(
          "way",
          [](const Anew& self, int arm, int number) {
            need(arm >= 0 && arm < self.arms(), "no such arm");
            const auto* motion = self.way(arm, number);
            need(motion != nullptr, "no such way");
            return to_numpy<Out2>(rows_of(motion->q), static_cast<size_t>(motion->last) + 1, motion->arm->dof);
          },
          nb::arg("arm"), nb::arg("number"), nb::sig("def way(self, arm: int, number: int) -> numpy.ndarray"),
          "A way [steps + 1, dof] in as few steps as full speed allows.")
      .def(
          "closed",
          [](Anew& self, const std::vector<int>& choice, const Clock& clock) {
            need(self.has(choice), "a way for each arm");
            nb::gil_scoped_release release;
            return self.closed(choice, clock);
          },
          nb::arg("choice"), nb::arg("clock"),
          nb::sig("def closed(self, choice: collections.abc.Sequence[int], clock: Clock) -> list[tuple[int, int]]"),
          "Pairs of arms that cannot both come to their ends on the ways with these numbers, whoever waits for whom; "
          "those "
          "found until the clock ends.")
      .def(
          "run",
          [](Anew& self, double limit, const Clock& clock) -> nb::object {
            need(!std::isnan(limit), "limit must be a number");
            Anew::Rows found;
            {
              nb::gil_scoped_release release;
              found = self.run(limit, clock);
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
          "choice of them can be driven at once that was not given before. `levels` are proved of every pair.");
}

}  // namespace mmp
