#include "bindings/bindings.hpp"
#include "proof/swept_conflicts.hpp"

namespace mmp {

void bind_motion(nb::module_& m) {
  nb::class_<SearchMotion>(m, "Motion", "One arm's trajectory on the grid of steps, with its sphere centres.")
      .def(
          "__init__",
          [](SearchMotion* self, const Cell& cell, int arm, Matrix q) {
            require_rows(cell, arm, q);
            require(q.shape(0) > 0, "a motion needs one step at least");
            nb::gil_scoped_release release;
            new (self) SearchMotion(cell.single, arm, {q.data(), q.data() + q.size()});
          },
          nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::keep_alive<1, 2>())
      .def_ro("arm", &SearchMotion::arm_index)
      .def_ro("last", &SearchMotion::last, "Index of the last step.")
      .def(
          "may_be_near",
          [](const SearchMotion& self, const SearchMotion& other, double distance) {
            return self.whole.near(other.whole, float(checked_number(distance)));
          },
          nb::arg("other"), nb::arg("distance"),
          "Returns whether boxes around all moving links at all steps are closer than `distance` [m].");

  m.def(
      "conflict_instants",
      [](const Cell& cell, nb::handle motions, Pairs pairs, const Levels<double>& levels, bool bases) {
        require_frozen(cell);
        const auto held = held_motions(motions, cell.single);
        const auto& of = held.items();
        const int n = static_cast<int>(pairs.shape(0)), count = static_cast<int>(of.size());
        const std::vector<int> numbers(pairs.data(), pairs.data() + pairs.size());
        for (const int k : numbers) require(k >= 0 && k < count, "no such motion");
        for (int k = 0; k < n; ++k)
          require(of[numbers[2 * k]]->arm_index != of[numbers[2 * k + 1]]->arm_index,
                  "a pair needs motions of two arms");
        std::vector<std::vector<double>> found(n);
        {
          nb::gil_scoped_release release;
          PairCheck<Floats> check(cell.world<Floats>(), bases);
          for (int k = 0; k < n; ++k) check(*of[numbers[2 * k]], *of[numbers[2 * k + 1]], as_float(levels), found[k]);
        }
        nb::list out;
        for (auto& steps : found) {
          const size_t size = steps.size();
          out.append(to_numpy<Out1>(std::move(steps), size));
        }
        return out;
      },
      nb::arg("cell"), nb::arg("motions"), nb::arg("pairs"), nb::arg("levels"), nb::kw_only(), nb::arg("bases") = false,
      nb::sig(
          "def conflict_instants(cell: Cell, motions: collections.abc.Sequence[Motion], pairs: numpy.ndarray, levels: "
          "Levels, *, bases: bool = False) -> list[numpy.ndarray]"),
      "Returns the instants of conflict of each pair of motions, in steps, ascending. An integer: surfaces are closer "
      "than `margin` at that step. A fraction: a contact between two steps. Elsewhere `proof` is proved at every "
      "instant. A motion stays at its last step forever. `bases` also tests moving links against the other's base.");

  m.def(
      "swept_conflicts",
      [](nb::handle_t<SearchMotion> first, nb::handle_t<SearchMotion> second, double distance) {
        const Held<SearchMotion> held(nb::make_tuple(first, second), "two Motions are needed");
        const SearchMotion &a = *held.items()[0], &b = *held.items()[1];
        require(a.arm_index != b.arm_index, "a pair needs motions of two arms");
        checked_number(distance);
        std::vector<uint8_t> found;
        SweptConflicts<Floats> conflicts(a, b, float(distance));
        const size_t rows = conflicts.rows(), columns = conflicts.columns();
        require(rows <= kMaxRows / columns, "too many steps");
        {
          nb::gil_scoped_release release;
          found = conflicts.matrix();
        }
        return to_numpy<Flags2>(std::move(found), rows, columns);
      },
      nb::arg("first"), nb::arg("second"), nb::arg("distance"),
      nb::sig("def swept_conflicts(first: Motion, second: Motion, distance: float) -> numpy.ndarray"),
      "Returns which steps of two motions [steps of the first, steps of the second] may come closer than `distance` "
      "[m], whenever the arms do them. The motions may be of two cells, such as with and without a held object. "
      "Spheres "
      "decide, also where arms have hulls. A motion of one configuration counts as one step.");

  nb::class_<SearchConstraint>(
      m, "Constraint",
      "Region that one arm must avoid in the open window (start, end) of steps; at one instant if both are equal.")
      .def_static(
          "ball",
          [](Vector center, double radius, double start, double end) {
            require(center.shape(0) > 0 && center.shape(0) <= kMaxDof, "a configuration is needed");
            require(all_within(center.data(), center.size(), kMaxJoint), "a configuration must be finite");
            return SearchConstraint::ball(as<float>(center), float(checked_size(radius)), window_of(start, end));
          },
          nb::arg("center"), nb::arg("radius"), nb::arg("start"), nb::arg("end"),
          "Forbids every joint to be within `radius` [rad] of a configuration.")
      .def_static(
          "standing",
          [](const Cell& cell, int arm, Vector q, double shrink, double start, double end) {
            require_joints(cell, arm, q);
            return SearchConstraint::standing(cell.single.arms[arm], as<float>(q).data(), float(checked_number(shrink)),
                                              window_of(start, end));
          },
          nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::kw_only(), nb::arg("shrink") = 0.0, nb::arg("start"),
          nb::arg("end"), nb::keep_alive<0, 1>(),
          "Forbids contact with another arm that stands at q, its spheres smaller by `shrink` [m].")
      .def_static(
          "moving",
          [](nb::handle_t<SearchMotion> motion, double start, double end) {
            if (!nb::inst_ready(motion)) throw nb::type_error("a Motion is needed");
            require(start == std::floor(start) && end == std::floor(end), "start and end must be whole steps");
            const Window window = window_of(start, end);
            nb::list out;
            for (auto& part :
                 SearchConstraint::moving(nb::cast<const SearchMotion&>(motion), int(window.from), int(window.until))) {
              nb::object object = nb::cast(std::move(part));
              nb::keep_alive_obj(object, motion);
              out.append(object);
            }
            return out;
          },
          nb::arg("motion"), nb::arg("start"), nb::arg("end"),
          nb::sig("def moving(motion: Motion, start: float, end: float) -> list[Constraint]"),
          "Forbids contact with another arm that moves, from step `start` to `end`: one constraint per step.")
      .def_static(
          "sphere",
          [](Vector center, double radius, int first_link, double start, double end) {
            require(center.shape(0) == 3 && first_link > 0, "center needs 3 numbers, and first_link must move");
            for (int k = 0; k < 3; ++k) checked_number(center.data()[k]);
            return SearchConstraint::ball_in_space(as<float>(center).data(), float(checked_size(radius)), first_link,
                                                   window_of(start, end));
          },
          nb::arg("center"), nb::arg("radius"), nb::arg("first_link"), nb::arg("start"), nb::arg("end"),
          "Forbids contact of links from `first_link` on with a sphere in the world.")
      .def_prop_ro("start", [](const SearchConstraint& c) { return c.window.from; })
      .def_prop_ro("end", [](const SearchConstraint& c) { return c.window.until; });
}

}  // namespace mmp
