#include "bindings/bindings.hpp"
#include "joint_space/composite_rrt.hpp"

namespace mmp {

namespace {

using Search = CompositeSearch<Floats>;

int all_joints(const Cell& cell, const std::vector<int>& arms) {
  int dof = 0;
  for (const int arm : arms) dof += cell.single.arms[arm].dof;
  return dof;
}

void require_all_joints(const Vector& q, int dof) {
  require(q.shape(0) == static_cast<size_t>(dof), "wrong number of joints");
  require(all_within(q.data(), q.size(), kMaxJoint), "a configuration must be finite, and within 1e4 rad");
}

}  // namespace

void bind_joint_space(nb::module_& m) {
  const CompositeSettings defaults;
  nb::class_<CompositeSettings>(m, "CompositeSettings", "Settings of `CompositeSearch`.")
      .def(
          "__init__",
          [](CompositeSettings* self, double range, double step) {
            require(range >= 1e-3 && step >= 1e-4, "range and step must be 1e-3 and 1e-4 rad at least");
            new (self) CompositeSettings{checked_number(range), checked_number(step)};
          },
          nb::kw_only(), nb::arg("range") = defaults.range, nb::arg("step") = defaults.step)
      .def_ro("range", &CompositeSettings::range, "Longest move of an arm on an edge, L2 [rad].")
      .def_ro("step", &CompositeSettings::step, "Distance between samples of an edge, largest joint [rad].");

  nb::class_<Search>(m, "CompositeSearch",
                     "RRT-Connect over all joints of all arms, or of some. The search can be continued.")
      .def(
          "__init__",
          [](Search* self, const Cell& cell, Vector start, Matrix goals, const Levels<double>& samples,
             const Levels<double>& edges, uint64_t seed, const CompositeSettings& settings,
             const std::optional<std::vector<int>>& arms) {
            auto chosen = arms_of(cell, arms);
            const int dof = all_joints(cell, chosen);
            require_all_joints(start, dof);
            require_configurations(goals, dof);
            require(goals.shape(0) > 0, "one goal at least is needed");
            new (self) Search(cell.world<Floats>(), std::move(chosen), as<float>(start), separate_rows<float>(goals),
                              as_float(samples), as_float(edges), settings, seed);
          },
          nb::arg("cell"), nb::kw_only(), nb::arg("start"), nb::arg("goals"), nb::arg("samples"), nb::arg("edges"),
          nb::arg("seed"), nb::arg("settings") = defaults, nb::arg("arms") = nb::none(), nb::keep_alive<1, 2>(),
          nb::sig(
              "def __init__(self, cell: Cell, *, start: numpy.ndarray, goals: numpy.ndarray, samples: Levels, edges: "
              "Levels, seed: int, settings: CompositeSettings = ..., arms: collections.abc.Sequence[int] | None = "
              "None) -> "
              "None"),
          "`start` [all joints]; `goals` [n, all joints]: a path may end at any of them. `samples`: levels at the "
          "samples of an edge; `edges`: levels that are proved along a path. `arms`: ascending numbers of the arms "
          "that "
          "move, by default all; the others are there with their bases only.")
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
          "Returns a path [n, all joints], proved at every instant, or None if `iterations` more do not find one.")
      .def_prop_ro("iterations", &Search::iterations, "Number of iterations so far.")
      .def_prop_ro("steps", &Search::steps, "Number of steps of all arms so far, with those that added no node.")
      .def_prop_ro("nodes", &Search::nodes, "Number of nodes of both trees.");
}

}  // namespace mmp
