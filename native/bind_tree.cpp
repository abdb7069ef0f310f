#include "bindings.hpp"

namespace mmp {

void bind_tree(nb::module_& m) {
  m.def(
      "search_tree",
      [](SearchArm& arm, nb::handle others, uint64_t seed, const Clock& clock, int iterations) {
        const auto movers = held_motions(others, arm.cell(), arm.arm());
        LowLevelOptions options;
        options.max_iterations = options.improve_iterations = checked_count(iterations);
        SeenTree<float> seen;
        LowLevelPath<float> path;
        {
          nb::gil_scoped_release release;
          path = arm.plan({}, movers.read_only(), {}, options, seed, clock, &seen);
        }
        const size_t dof = arm.dof(), count = seen.links.size() / 2;
        nb::object way = nb::none();
        if (path.found) way = nb::cast(to_numpy<Out2>(rows_of(path.positions), path.positions.size() / dof, dof));
        return nb::make_tuple(to_numpy<Out2>(rows_of(seen.positions), count, dof),
                              to_numpy<Windows>(seen.links, count, 2), way);
      },
      nb::arg("arm"), nb::arg("others"), nb::arg("seed"), nb::arg("clock"), nb::arg("iterations"),
      nb::sig("def search_tree(arm: SingleArm, others: collections.abc.Sequence[Motion], seed: int, clock: Clock, "
              "iterations: int) -> tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray | None]"),
      "The tree that SI-RRT* has grown among `others` after so many iterations, whether it has found a path or not: "
      "configurations [v, dof], the step of arrival and the vertex before each [v, 2] (-1: none), and the path.");
}

}  // namespace mmp
