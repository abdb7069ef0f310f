#include "bindings.hpp"
#include "composite.hpp"
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
        const size_t arms = cell.single.arms.size();
        need(arms > 0 && q.size() == arms && max_step.size() == arms, "one array for each arm");
        std::vector<std::vector<float>> rows, speeds;
        for (size_t a = 0; a < arms; ++a) {
          need_rows(cell, static_cast<int>(a), q[a]);
          need_joints(cell, static_cast<int>(a), max_step[a]);
          for (size_t k = 0; k < max_step[a].size(); ++k) need(max_step[a].data()[k] > 0, "steps must be positive");
          need(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "as many rows for each arm");
          rows.emplace_back(q[a].data(), q[a].data() + q[a].size());
          speeds.push_back(as<float>(max_step[a]));
        }
        std::vector<std::vector<double>> found;
        int kept = 0;
        {
          nb::gil_scoped_release release;
          Shortener<Floats> shortener(cell.world<Floats>(), rows, std::move(speeds), levels_of(margin, alone),
                                      levels_of(margin, between));
          Random random(seed);
          kept = shortener.run(attempts, random, clock);
          for (size_t a = 0; a < arms; ++a) found.push_back(rows_of(shortener.rows(static_cast<int>(a))));
        }
        nb::list out;
        for (size_t a = 0; a < arms; ++a) {
          const size_t dof = static_cast<size_t>(cell.single.arms[a].dof), n = found[a].size() / dof;
          out.append(to_numpy<Out2>(std::move(found[a]), n, dof));
        }
        return nb::make_tuple(out, kept);
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
}

}  // namespace mmp
