#include "bindings/bindings.hpp"
#include "joint_space/composite_rrt.hpp"

namespace mmp {

namespace {

using Search = CompositeSearch<Floats>;

void require_all_joints(const Cell& cell, const Vector& q) {
  require_frozen(cell);
  size_t dof = 0;
  for (const auto& arm : cell.single.arms) dof += static_cast<size_t>(arm.dof);
  require(q.shape(0) == dof, "wrong number of joints");
  require(all_within(q.data(), q.size(), kMostJoint), "a configuration must be finite, and within 1e4 rad");
}

}  // namespace

void bind_joint_space(nb::module_& m) {
  nb::class_<Search>(m, "CompositeSearch", "RRT-Connect in the space of all joints of all arms; can be asked to go on.")
      .def(
          "__init__",
          [](Search* self, const Cell& cell, Vector start, Vector goal, const Levels<double>& samples,
             const Levels<double>& edges, double range, double step, uint64_t seed) {
            require_all_joints(cell, start);
            require_all_joints(cell, goal);
            require(range >= 1e-3 && step >= 1e-4, "range and step must be 1e-3 and 1e-4 rad at least");
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
              const auto path = self.grow(iterations, clock);
              n = path.size();
              for (const float* q : path) rows.insert(rows.end(), q, q + self.dof());
            }
            if (n == 0) return nb::none();
            return nb::cast(to_numpy<Out2>(std::move(rows), n, self.dof()));
          },
          nb::arg("iterations"), nb::arg("clock"),
          nb::sig("def grow(self, iterations: int, clock: Clock) -> numpy.ndarray | None"),
          "A way [n, all joints], proved at every instant, or None if that many more iterations found none.")
      .def_prop_ro("iterations", &Search::iterations, "Iterations so far.")
      .def_prop_ro("nodes", &Search::nodes, "Nodes of both trees.");
}

}  // namespace mmp
