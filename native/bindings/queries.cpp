#include "bindings/bindings.hpp"
#include "geometry/nearest_bodies.hpp"
#include "proof/certificate.hpp"
#include "proof/swept_clearance.hpp"

namespace mmp {

void bind_queries(nb::module_& m) {
  nb::class_<NearestBodies>(m, "NearestBodies", "Two bodies and their distance.")
      .def_ro("clearance", &NearestBodies::clearance, "Distance of the surfaces [m].")
      .def_ro("arm", &NearestBodies::arm, "Arm of the first body; -1 if there are no such bodies.")
      .def_ro("link", &NearestBodies::link, "Link of the first body.")
      .def_ro("other", &NearestBodies::other, "Arm of the second body, or obstacle.")
      .def_ro("other_link", &NearestBodies::other_link, "Link of the second body; -1 for an obstacle.");

  nb::class_<Proof>(m, "Proof", "Result of `certify`.")
      .def_ro("valid", &Proof::valid, "Whether `clearance` is proved.")
      .def_ro("clearance", &Proof::clearance, "Proved clearance between arms [m]; if not valid, one that is violated.")
      .def_ro("arm_a", &Proof::arm_a, "Arm with the least clearance, or with a violation.")
      .def_ro("arm_b", &Proof::arm_b, "Other arm; -1: `arm_a` alone.")
      .def_ro("segment", &Proof::segment, "Segment of the least clearance, or of the violation.")
      .def_ro("fraction", &Proof::fraction, "Fraction of that segment.");

  m.def(
      "spheres",
      [](const Cell& cell, int arm, Matrix q) {
        require_rows(cell, arm, q);
        const auto& model = cell.precise.arms[arm];
        const size_t n = q.shape(0), s = model.spheres.size();
        std::vector<double> out(n * s * 3);
        {
          nb::gil_scoped_release release;
          Pose<Doubles> pose(model);
          Doubles joints[kMaxDof];
          for (size_t k = 0; k < n; k += width<Doubles>) {
            load_rows(q.data(), n, k, model.dof, joints);
            forward(joints, pose);
            for (size_t l = 1; l < model.links.size(); ++l) pose.detail(static_cast<int>(l));
            for (int lane = 0; lane < width<Doubles> && k + lane < n; ++lane)
              for (size_t i = 0; i < s; ++i) {
                double* p = out.data() + ((k + lane) * s + i) * 3;
                p[0] = pose.spheres[i].x[lane], p[1] = pose.spheres[i].y[lane], p[2] = pose.spheres[i].z[lane];
              }
          }
        }
        return to_numpy<Out3>(std::move(out), n, s, 3);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"),
      "Returns sphere centres [n, s, 3] [m] in the order of `sphere_table`.");

  m.def(
      "sphere_table",
      [](const Cell& cell, int arm) {
        const auto& model = arm_of(cell, arm);
        std::vector<double> out;
        for (size_t l = 0; l < model.links.size(); ++l)
          for (int s = 0; s < model.links[l].spheres.count; ++s) {
            out.push_back(static_cast<double>(l));
            out.push_back(model.spheres[model.links[l].spheres.first + s].r);
          }
        return to_numpy<Out2>(out, out.size() / 2, 2);
      },
      nb::arg("cell"), nb::arg("arm"), "Returns link index and radius [m] of every sphere, [s, 2].");

  m.def(
      "tool_points",
      [](const Cell& cell, int arm, Matrix q) {
        require_rows(cell, arm, q);
        const auto& model = cell.precise.arms[arm];
        const size_t n = q.shape(0);
        std::vector<double> out(n * 3);
        {
          nb::gil_scoped_release release;
          Pose<Doubles> pose(model);
          Doubles joints[kMaxDof];
          for (size_t k = 0; k < n; k += width<Doubles>) {
            load_rows(q.data(), n, k, model.dof, joints);
            forward(joints, pose);
            const auto* p = model.tool.p;
            const auto tip = Pose<Doubles>::apply(pose.frames[model.dof], {p[0], p[1], p[2], 0});
            for (int lane = 0; lane < width<Doubles> && k + lane < n; ++lane) {
              double* to = out.data() + (k + lane) * 3;
              to[0] = tip.x[lane], to[1] = tip.y[lane], to[2] = tip.z[lane];
            }
          }
        }
        return to_numpy<Out2>(std::move(out), n, 3);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"), "Returns tool points [n, 3] [m] in the world.");

  m.def(
      "static_clearance",
      [](const Cell& cell, int arm, Matrix q, bool precise) {
        require_rows(cell, arm, q);
        const size_t n = q.shape(0);
        std::vector<double> out(n);
        {
          nb::gil_scoped_release release;
          if (precise) static_clearance<Doubles>(cell, arm, q.data(), n, out.data());
          else static_clearance<Floats>(cell, arm, q.data(), n, out.data());
        }
        return to_numpy<Out1>(std::move(out), n);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::kw_only(), nb::arg("precise") = false,
      "Returns the clearance [n] [m] of one arm from obstacles, the other arms' bases and itself.");

  m.def(
      "pair_clearance",
      [](const Cell& cell, int a, Matrix qa, int b, Matrix qb, bool precise) {
        require_rows(cell, a, qa);
        require_rows(cell, b, qb);
        require(qa.shape(0) == qb.shape(0) && a != b, "two arms with the same number of rows are needed");
        const size_t n = qa.shape(0);
        std::vector<double> out(n);
        {
          nb::gil_scoped_release release;
          if (precise) pair_clearance<Doubles>(cell, a, qa.data(), b, qb.data(), n, out.data());
          else pair_clearance<Floats>(cell, a, qa.data(), b, qb.data(), n, out.data());
        }
        return to_numpy<Out1>(std::move(out), n);
      },
      nb::arg("cell"), nb::arg("a"), nb::arg("qa"), nb::arg("b"), nb::arg("qb"), nb::kw_only(),
      nb::arg("precise") = false, "Returns the clearance [n] [m] between two arms, bases included.");

  m.def(
      "swept_clearance",
      [](const Cell& cell, int arm, Matrix q, int shape, Vector pose, Vector size, double stray) {
        require_rows(cell, arm, q);
        require(q.shape(0) > 1, "a segment has two ends");
        require(stray >= 0 && stray <= kMaxLength, "stray must be 0 to 1e6");
        const auto body = checked_obstacle(shape, pose, size);
        const size_t n = q.shape(0);
        std::vector<double> out(n - 1);
        {
          nb::gil_scoped_release release;
          swept_clearance(cell, arm, q.data(), n, body, stray, out.data());
        }
        return to_numpy<Out1>(std::move(out), n - 1);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("shape"), nb::arg("pose"), nb::arg("size"), nb::kw_only(),
      nb::arg("stray") = 0.0,
      "Returns lower bounds [n - 1] [m] of the clearance of the moving links of one arm from a body, at every instant "
      "of "
      "the straight segments between the rows of q [n, dof]. `stray`: the arm may be so far from them in every joint. "
      "The body is one as of `add_obstacle` that is not in the cell.");

  m.def(
      "cell_clearance",
      [](const Cell& cell, const std::vector<Matrix>& q, bool obstacles) {
        require(!q.empty() && q.size() == cell.single.arms.size(), "one array per arm is needed");
        std::vector<const double*> rows;
        const size_t n = q[0].shape(0);
        for (size_t a = 0; a < q.size(); ++a) {
          require_rows(cell, static_cast<int>(a), q[a]);
          require(q[a].shape(0) == n, "every arm needs the same number of rows");
          rows.push_back(q[a].data());
        }
        std::vector<double> out(n);
        {
          nb::gil_scoped_release release;
          CellClearance clearance(cell);
          for (size_t k = 0; k < n; k += width<Floats>) store_lanes(clearance(rows, n, k, obstacles), out.data(), n, k);
        }
        return to_numpy<Out1>(std::move(out), n);
      },
      nb::arg("cell"), nb::arg("q"), nb::kw_only(), nb::arg("obstacles") = true,
      "Returns the least clearance [n] [m] of whole states over all pairs of arms, and with `obstacles` over arms and "
      "obstacles.");

  m.def(
      "nearest_bodies",
      [](const Cell& cell, const std::vector<Vector>& q) {
        require(!q.empty() && q.size() == cell.precise.arms.size(), "one configuration per arm is needed");
        std::vector<const double*> rows;
        for (size_t a = 0; a < q.size(); ++a) {
          require_joints(cell, static_cast<int>(a), q[a]);
          rows.push_back(q[a].data());
        }
        const auto found = nearest_bodies(cell, rows);
        return std::vector<NearestBodies>(found.begin(), found.end());
      },
      nb::arg("cell"), nb::arg("q"),
      nb::sig("def nearest_bodies(cell: Cell, q: collections.abc.Sequence[numpy.ndarray]) -> list[NearestBodies]"),
      "Returns, for one state q [dof] per arm, the nearest two arms, the nearest arm and obstacle, and the nearest "
      "parts of one arm, in double precision.");

  m.def(
      "edges_free",
      [](const Cell& cell, int arm, Matrix from, Matrix to, const Levels<double>& levels) {
        require_rows(cell, arm, from);
        require_rows(cell, arm, to);
        require(from.shape(0) == to.shape(0), "q_from and q_to need the same number of rows");
        const int n = static_cast<int>(from.shape(0)), dof = cell.single.arms[arm].dof;
        std::vector<SegmentResult<float>> results(n);
        {
          nb::gil_scoped_release release;
          std::vector<float> p(from.data(), from.data() + from.size()), q(to.data(), to.data() + to.size());
          Prover<Floats> prover(cell.world<Floats>());
          const auto at = [&](int s) { return std::pair<const float*, const float*>(&p[s * dof], &q[s * dof]); };
          prover.alone(arm, n, at, as_float(levels), Stop::at_first_contact_of_segment, results.data());
        }
        std::vector<bool> out;
        for (const auto& r : results) out.push_back(r.free);
        return to_numpy<Flags>(out, n);
      },
      nb::arg("cell"), nb::arg("arm"), nb::arg("q_from"), nb::arg("q_to"), nb::arg("levels"),
      "Returns whether straight segments keep `proof` at every instant and `margin` at the samples, against obstacles, "
      "other bases and the arm itself. Joint limits are the caller's task.");

  m.def(
      "certify",
      [](const Cell& cell, const std::vector<Matrix>& q, const Levels<double>& required, double share,
         const Clock& clock) {
        checked_size(required.proof);
        checked_share(share);
        require(!q.empty() && q.size() == cell.precise.arms.size(), "one array per arm is needed");
        std::vector<const double*> rows;
        for (size_t a = 0; a < q.size(); ++a) {
          require_rows(cell, static_cast<int>(a), q[a]);
          require(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "every arm needs the same number of rows");
          rows.push_back(q[a].data());
        }
        Proof proof;
        {
          nb::gil_scoped_release release;
          proof = Certifier<Doubles>(cell.world<Doubles>(), rows, static_cast<int>(q[0].shape(0)), required)
                      .run(share, clock);
        }
        return proof;
      },
      nb::arg("cell"), nb::arg("q"), nb::arg("required"), nb::arg("share"), nb::arg("clock"),
      nb::sig(
          "def certify(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], required: Levels, share: float, clock: "
          "Clock) -> Proof"),
      "Proves a clearance along q [n, dof] per arm, linear in between: at least `required.proof`, and all but a "
      "`share` "
      "of what the sampled clearance has beyond it.");
}

}  // namespace mmp
