#include "bindings.hpp"
#include "composite.hpp"
#include "replanner.hpp"
#include "shortcut.hpp"

namespace mmp {

namespace {

using Search = CompositeSearch<Floats>;

void need_all_joints(const Cell& cell, const Vector& q) {
  need(cell.frozen, "the cell is not frozen");
  size_t dof = 0;
  for (const auto& arm : cell.single.arms) dof += static_cast<size_t>(arm.dof);
  need(q.shape(0) == dof, "wrong number of joints");
  for (size_t k = 0; k < dof; ++k) need(std::abs(q.data()[k]) < 1e4, "joints must be finite");
}

// All arms on one grid of steps, as it comes from Python.
struct JointMotion {
  std::vector<std::vector<float>> rows, max_step;

  JointMotion(const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& steps) {
    const size_t arms = cell.single.arms.size();
    need(arms > 0 && q.size() == arms && steps.size() == arms, "one array for each arm");
    for (size_t a = 0; a < arms; ++a) {
      need_rows(cell, static_cast<int>(a), q[a]);
      need_joints(cell, static_cast<int>(a), steps[a]);
      for (size_t k = 0; k < steps[a].size(); ++k) need(steps[a].data()[k] > 0, "steps must be positive");
      need(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "as many rows for each arm");
      rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
      max_step.push_back(as<float>(steps[a]));
    }
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
          [](Search* self, const Cell& cell, Vector start, Vector goal, double margin, double margin_of_proof,
             double proof, double range, double step, uint64_t seed) {
            need_all_joints(cell, start);
            need_all_joints(cell, goal);
            need(range > 0 && step > 0, "range and step must be positive");
            new (self) Search(cell.world<Floats>(), as<float>(start), as<float>(goal), levels_of(margin, margin),
                              levels_of(margin_of_proof, proof), {range, step}, seed);
          },
          nb::arg("cell"), nb::arg("start"), nb::arg("goal"), nb::arg("margin"), nb::arg("margin_of_proof"),
          nb::arg("proof"), nb::arg("range"), nb::arg("step"), nb::arg("seed"), nb::keep_alive<1, 2>())
      .def(
          "grow",
          [](Search& self, int iterations, const Clock& clock) -> nb::object {
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
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_step, double margin,
         double alone, double between, int attempts, uint64_t seed, const Clock& clock) {
        const JointMotion motion(cell, q, max_step);
        return motion.improved(cell, [&](std::vector<std::vector<double>>& found) {
          Shortener<Floats> shortener(cell.world<Floats>(), motion.rows, motion.max_step, levels_of(margin, alone),
                                      levels_of(margin, between));
          Random random(seed);
          const int kept = shortener.run(attempts, random, clock);
          for (size_t a = 0; a < q.size(); ++a) found.push_back(rows_of(shortener.rows(static_cast<int>(a))));
          return kept;
        });
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("max_step"), nb::arg("margin"), nb::arg("alone"), nb::arg("between"),
      nb::arg("attempts"), nb::arg("seed"), nb::arg("clock"),
      nb::sig("def shorten(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], max_step: "
              "collections.abc.Sequence[numpy.ndarray], margin: float, alone: float, between: float, attempts: int, "
              "seed: int, clock: Clock) -> tuple[list[numpy.ndarray], int]"),
      "Shortcuts on the common clock: q [steps + 1, dof] per arm of a safe plan; returns the shorter one and the "
      "number "
      "of stretches that were replaced. `alone` and `between` [m] are proved of one arm and of pairs at every "
      "instant.");

  m.def(
      "replan",
      [](const Cell& cell, const std::vector<Matrix>& q, const std::vector<Vector>& max_step, double margin,
         double proof, int attempts, uint64_t seed, const Clock& clock) {
        const JointMotion motion(cell, q, max_step);
        return motion.improved(cell, [&](std::vector<std::vector<double>>& found) {
          Replanner<Floats> replanner(*cell.world_planning, motion.rows, motion.max_step, levels_of(margin, proof));
          Random random(seed);
          const int kept = replanner.run(attempts, random, clock);
          for (size_t a = 0; a < q.size(); ++a) found.push_back(rows_of(replanner.rows(static_cast<int>(a))));
          return kept;
        });
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("max_step"), nb::arg("margin"), nb::arg("proof"), nb::arg("attempts"),
      nb::arg("seed"), nb::arg("clock"),
      nb::sig("def replan(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], max_step: "
              "collections.abc.Sequence[numpy.ndarray], margin: float, proof: float, attempts: int, seed: int, clock: "
              "Clock) -> tuple[list[numpy.ndarray], int]"),
      "Shorter ways of single arms, for which another one may make room: q [steps + 1, dof] per arm of a safe plan; "
      "returns the shorter one and the number of attempts that succeeded. `proof` [m] is proved of every new way.");
}

}  // namespace mmp
