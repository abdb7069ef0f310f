#include "bindings/bindings.hpp"
#include "joint_space/group_search.hpp"

namespace mmp {

namespace {

using Composite = CompositeSearch<Floats>;
using Groups = GroupSearch<Floats>;

int joints_of(const Cell& cell, const std::vector<int>& arms) {
  int dof = 0;
  for (const int a : arms) dof += cell.single.arms[a].dof;
  return dof;
}
int all_joints(const Cell& cell) {
  require_frozen(cell);
  return joints_of(cell, all_arms(cell));
}

// Returns the arms that are asked for, or all.
std::vector<int> some_arms(const Cell& cell, const std::optional<std::vector<int>>& asked) {
  require_frozen(cell);
  if (!asked) return all_arms(cell);
  require(!asked->empty(), "one arm at least is needed");
  for (size_t k = 0; k < asked->size(); ++k) {
    arm_of(cell, (*asked)[k]);
    require(k == 0 || (*asked)[k - 1] < (*asked)[k], "arms must be in ascending order");
  }
  return *asked;
}

void require_all_joints(const Vector& q, int dof) {
  require(q.shape(0) == static_cast<size_t>(dof), "wrong number of joints");
  require(all_within(q.data(), q.size(), kMaxJoint), "a configuration must be finite, and within 1e4 rad");
}

template <class Search>
nb::object grow(Search& self, int iterations, const Clock& clock) {
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
}

// What both searches have.
template <class Search>
void bind_search(nb::class_<Search>& search) {
  search
      .def("grow", &grow<Search>, nb::arg("iterations"), nb::arg("clock"),
           nb::sig("def grow(self, iterations: int, clock: Clock) -> numpy.ndarray | None"),
           "Returns a path [n, all joints], proved at every instant, or None if `iterations` more do not find one.")
      .def_prop_ro("iterations", &Search::iterations, "Number of iterations so far.")
      .def_prop_ro("steps", &Search::steps, "Number of steps of all arms so far, with those that added no node.");
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

  nb::class_<Composite> composite(m, "CompositeSearch",
                                  "RRT-Connect over all joints of all arms, or of some. The search can be continued.");
  composite
      .def(
          "__init__",
          [](Composite* self, const Cell& cell, Vector start, Matrix goals, const Levels<double>& samples,
             const Levels<double>& edges, uint64_t seed, const CompositeSettings& settings,
             const std::optional<std::vector<int>>& asked) {
            const auto arms = some_arms(cell, asked);
            const int dof = joints_of(cell, arms);
            require_all_joints(start, dof);
            require_configurations(goals, dof);
            require(goals.shape(0) > 0, "one goal at least is needed");
            new (self) Composite(cell.world<Floats>(), arms, as<float>(start), separate_rows<float>(goals),
                                 as_float(samples), as_float(edges), settings, seed);
          },
          nb::arg("cell"), nb::kw_only(), nb::arg("start"), nb::arg("goals"), nb::arg("samples"), nb::arg("edges"),
          nb::arg("seed"), nb::arg("settings") = defaults, nb::arg("arms") = nb::none(), nb::keep_alive<1, 2>(),
          nb::sig("def __init__(self, cell: Cell, *, start: numpy.ndarray, goals: numpy.ndarray, samples: Levels, "
                  "edges: Levels, seed: int, settings: CompositeSettings = ..., arms: collections.abc.Sequence[int] | "
                  "None = None) -> None"),
          "`start` [all joints]; `goals` [n, all joints]: a path may end at any of them. `samples`: levels at the "
          "samples of an edge; `edges`: levels that are proved along a path. `arms`, ascending: only these are "
          "searched, and only bases are there of the others; without it, all.")
      .def_prop_ro("nodes", &Composite::nodes, "Number of nodes of both trees.");
  bind_search(composite);

  nb::class_<Groups> groups(m, "GroupSearch", "RRT-Connect for growing groups of arms. The search can be continued.");
  groups.def(
      "__init__",
      [](Groups* self, const Cell& cell, Vector start, Vector goal, const Levels<double>& samples,
         const Levels<double>& edges, uint64_t seed, const CompositeSettings& settings, int most) {
        const int dof = all_joints(cell);
        require_all_joints(start, dof);
        require_all_joints(goal, dof);
        checked_count(most);
        require(most >= 1, "a group has one arm at least");
        new (self) Groups(cell.world<Floats>(), as<float>(start), as<float>(goal), as_float(samples), as_float(edges),
                          {settings, most}, seed);
      },
      nb::arg("cell"), nb::kw_only(), nb::arg("start"), nb::arg("goal"), nb::arg("samples"), nb::arg("edges"),
      nb::arg("seed"), nb::arg("settings") = defaults, nb::arg("most") = GroupSettings{}.most, nb::keep_alive<1, 2>(),
      nb::sig("def __init__(self, cell: Cell, *, start: numpy.ndarray, goal: numpy.ndarray, samples: Levels, edges: "
              "Levels, seed: int, settings: CompositeSettings = ..., most: int = ...) -> None"),
      "`start` and `goal` [all joints]. `samples`: levels at the samples of an edge; `edges`: levels that are proved "
      "along a path. `most`: largest number of arms in a group.");
  bind_search(groups);
}

}  // namespace mmp
