// The binding: checks only what would crash; messages, shapes and allocation are Python's business (mmp_env/collision.py).
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "cell.hpp"

namespace nb = nanobind;
using namespace mmp;

namespace {

using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Pairs = nb::ndarray<const int32_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Out1 = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using Out2 = nb::ndarray<nb::numpy, double, nb::ndim<2>>;
using Out3 = nb::ndarray<nb::numpy, double, nb::ndim<3>>;
using Flags = nb::ndarray<nb::numpy, bool, nb::ndim<1>>;
using Windows = nb::ndarray<nb::numpy, int32_t, nb::ndim<2>>;

template <class Array, class From, class... Shape>
Array to_numpy(std::vector<From> values, Shape... shape) {
  using To = typename Array::Scalar;
  auto* data = new To[values.size() + 1];
  std::copy(values.begin(), values.end(), data);
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<To*>(p); });
  return Array(data, {static_cast<size_t>(shape)...}, owner);
}

void need(bool ok, const char* message) {
  if (!ok) throw nb::value_error(message);
}

void need_rows(const Cell& cell, int arm, const Matrix& q) {
  need(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
  need(q.shape(1) == static_cast<size_t>(cell.precise.arms[arm].dof), "wrong number of joints");
}

void need_joints(const Cell& cell, int arm, const Vector& q) {
  need(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
  need(q.shape(0) == static_cast<size_t>(cell.precise.arms[arm].dof), "wrong number of joints");
}

// Python's signal handlers run while a long call is under way: the interpreter is asked every 20 ms.
struct Interrupted {};
bool poll_signals(const Clock& clock) {
  const auto now = Clock::Steady::now();
  if (now < clock.next_poll_) return false;
  clock.next_poll_ = now + std::chrono::milliseconds(20);
  nb::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
  return false;
}

template <class T>
std::vector<T> as(const Vector& v) {
  return {v.data(), v.data() + v.size()};
}

template <class T>
void add_arm(CellModel<T>& cell, const Matrix& fixed, const Vector& tool, const Vector& lower, const Vector& upper,
             const nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig>& link_frames, const Matrix& spheres,
             const nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig>& sphere_links, const Pairs& self_pairs) {
  ArmModel<T> arm;
  arm.dof = static_cast<int>(fixed.shape(0));
  const auto transform = [](const double* p) {
    Transform<T> t;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) t.r[3 * i + j] = T(p[4 * i + j]);
      t.p[i] = T(p[4 * i + 3]);
    }
    return t;
  };
  for (int j = 0; j < arm.dof; ++j) arm.fixed.push_back(transform(fixed.data() + 12 * j));
  arm.tool = transform(tool.data());
  arm.lower = as<T>(lower);
  arm.upper = as<T>(upper);
  for (size_t l = 0; l < link_frames.shape(0); ++l) {
    Link<T> link;
    link.frame = link_frames.data()[l];
    link.spheres.first = static_cast<int>(arm.spheres.size());
    for (size_t s = 0; s < spheres.shape(0); ++s)
      if (sphere_links.data()[s] == static_cast<int>(l)) {
        const double* p = spheres.data() + 4 * s;
        arm.spheres.push_back({T(p[0]), T(p[1]), T(p[2]), T(p[3])});
      }
    link.spheres.count = static_cast<int>(arm.spheres.size()) - link.spheres.first;
    arm.links.push_back(link);
  }
  for (size_t k = 0; k < self_pairs.shape(0); ++k)
    arm.self_pairs.emplace_back(self_pairs.data()[2 * k], self_pairs.data()[2 * k + 1]);
  cell.arms.push_back(std::move(arm));
}

template <class T>
void add_obstacle(CellModel<T>& cell, int shape, const Vector& pose, const Vector& size) {
  Obstacle<T> o;
  o.shape = static_cast<Shape>(shape);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) o.pose.r[3 * i + j] = T(pose.data()[4 * i + j]);
    o.pose.p[i] = T(pose.data()[4 * i + 3]);
  }
  o.a = T(size.data()[0]);
  o.b = T(size.data()[1]);
  o.c = T(size.data()[2]);
  cell.obstacles.push_back(o);
}

using SearchMotion = Motion<Floats>;
using SearchConstraint = Constraint<Floats>;
using SearchArm = SingleArm<Floats>;

Levels<float> levels_of(double margin, double proof) { return {float(margin), float(proof)}; }

std::vector<double> rows_of(const std::vector<float>& values) { return {values.begin(), values.end()}; }

RepulsionOptions repulsion_options(double alpha, double k_rep, double d0, int max_iterations, bool centre_distance,
                                   bool normalised, double normalised_step, double max_step, double comfort) {
  return {alpha, k_rep, d0, max_iterations, centre_distance, normalised, normalised_step, max_step, comfort};
}

int cpu_level() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  // By feature: the names of the levels are unknown to Clang before 17.
  const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
                  __builtin_cpu_supports("fma");
  const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                  __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512vl");
  return v4 ? 4 : v3 ? 3 : 1;
#else
  return 1;
#endif
}

}  // namespace

NB_MODULE(MMP_MODULE, m) {
  m.doc() = "Native core of mmp-env: kinematics, clearance, proofs, single-arm search and repulsion. Arrays are float64.";
  m.attr("LANES") = MMP_LANES;
  m.attr("FOREVER") = kForever;
  m.def("cpu_level", &cpu_level, "The x86-64 level (1, 3 or 4) that this processor supports; 1 elsewhere.");

  nb::class_<Clock>(m, "Clock", "A deadline in seconds from now, and a flag; long calls look at both and at signals.")
      .def("__init__", [](Clock* self, double seconds) { new (self) Clock(seconds); self->poll_ = poll_signals; },
           nb::arg("seconds"))
      .def("cancel", &Clock::cancel, "Ends every call that holds this clock, from any thread.")
      .def_prop_ro("expired", [](const Clock& c) { return c.cancelled() || c.remaining() <= 0; })
      .def_prop_ro("remaining", &Clock::remaining, "[s]");

  nb::class_<Cell>(m, "Cell", "Arms and obstacles; add all of them, then freeze.")
      .def(nb::init<>())
      .def("add_arm",
           [](Cell& self, Matrix fixed, Vector tool, Vector lower, Vector upper,
              nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig> link_frames, Matrix spheres,
              nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig> sphere_links, Pairs self_pairs) {
             need(fixed.shape(0) <= kMaxDof && link_frames.shape(0) <= kMaxLinks, "an arm has 16 joints at most");
             add_arm(self.single, fixed, tool, lower, upper, link_frames, spheres, sphere_links, self_pairs);
             add_arm(self.precise, fixed, tool, lower, upper, link_frames, spheres, sphere_links, self_pairs);
           },
           nb::arg("fixed"), nb::arg("tool"), nb::arg("lower"), nb::arg("upper"), nb::arg("link_frames"),
           nb::arg("spheres"), nb::arg("sphere_links"), nb::arg("self_pairs"),
           "fixed [dof, 12]: rows of T_frame(k)_frame(k+1) at q = 0, joint axis z, the first one in the world; spheres "
           "[s, 4] in the frame of their link, the base's (link 0) in the world.")
      .def("add_obstacle",
           [](Cell& self, int shape, Vector pose, Vector size) {
             add_obstacle(self.single, shape, pose, size);
             add_obstacle(self.precise, shape, pose, size);
           },
           nb::arg("shape"), nb::arg("pose"), nb::arg("size"))
      .def("freeze", &Cell::freeze);

  m.def("spheres",
        [](const Cell& cell, int arm, Matrix q) {
          need_rows(cell, arm, q);
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
        nb::arg("cell"), nb::arg("arm"), nb::arg("q"), "Sphere centres [n, s, 3] [m] in the order of `sphere_table`.");

  m.def("sphere_table",
        [](const Cell& cell, int arm) {
          need(arm >= 0 && arm < static_cast<int>(cell.precise.arms.size()), "no such arm");
          const auto& model = cell.precise.arms[arm];
          std::vector<double> out;
          for (size_t l = 0; l < model.links.size(); ++l)
            for (int s = 0; s < model.links[l].spheres.count; ++s) {
              out.push_back(static_cast<double>(l));
              out.push_back(model.spheres[model.links[l].spheres.first + s].r);
            }
          return to_numpy<Out2>(out, out.size() / 2, 2);
        },
        nb::arg("cell"), nb::arg("arm"), "Link index and radius [m] of every sphere, [s, 2].");

  m.def("tool_points",
        [](const Cell& cell, int arm, Matrix q) {
          need_rows(cell, arm, q);
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
        nb::arg("cell"), nb::arg("arm"), nb::arg("q"), "Tool points [n, 3] [m] in the world.");

  m.def("static_clearance",
        [](const Cell& cell, int arm, Matrix q, bool precise) {
          need_rows(cell, arm, q);
          const size_t n = q.shape(0);
          std::vector<double> out(n);
          {
            nb::gil_scoped_release release;
            if (precise) static_clearance<Doubles>(cell, arm, q.data(), n, out.data());
            else static_clearance<Floats>(cell, arm, q.data(), n, out.data());
          }
          return to_numpy<Out1>(std::move(out), n);
        },
        nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("precise") = false,
        "Clearance [n] [m] of one arm from obstacles, the other arms' bases and itself.");

  m.def("pair_clearance",
        [](const Cell& cell, int a, Matrix qa, int b, Matrix qb, bool precise) {
          need_rows(cell, a, qa);
          need_rows(cell, b, qb);
          need(qa.shape(0) == qb.shape(0) && a != b, "two arms, as many rows for each");
          const size_t n = qa.shape(0);
          std::vector<double> out(n);
          {
            nb::gil_scoped_release release;
            if (precise) pair_clearance<Doubles>(cell, a, qa.data(), b, qb.data(), n, out.data());
            else pair_clearance<Floats>(cell, a, qa.data(), b, qb.data(), n, out.data());
          }
          return to_numpy<Out1>(std::move(out), n);
        },
        nb::arg("cell"), nb::arg("a"), nb::arg("qa"), nb::arg("b"), nb::arg("qb"), nb::arg("precise") = false,
        "Clearance [n] [m] between two arms, bases included.");

  m.def("cell_clearance",
        [](const Cell& cell, const std::vector<Matrix>& q, bool obstacles) {
          need(!q.empty() && q.size() == cell.single.arms.size(), "one array of configurations for each arm");
          std::vector<const double*> rows;
          const size_t n = q[0].shape(0);
          for (size_t a = 0; a < q.size(); ++a) {
            need_rows(cell, static_cast<int>(a), q[a]);
            need(q[a].shape(0) == n, "as many rows for each arm");
            rows.push_back(q[a].data());
          }
          std::vector<double> out(n);
          {
            nb::gil_scoped_release release;
            CellClearance<Floats> clearance(cell);
            for (size_t k = 0; k < n; k += width<Floats>) store_lanes(clearance(rows, n, k, obstacles), out.data(), n, k);
          }
          return to_numpy<Out1>(std::move(out), n);
        },
        nb::arg("cell"), nb::arg("q"), nb::arg("obstacles") = true,
        "Least clearance [n] [m] of whole states over all pairs of arms and, with `obstacles`, arms and obstacles.");

  m.def("edges_free",
        [](const Cell& cell, int arm, Matrix from, Matrix to, double margin, double proof) {
          need_rows(cell, arm, from);
          need_rows(cell, arm, to);
          need(from.shape(0) == to.shape(0), "as many ends as beginnings");
          const int n = static_cast<int>(from.shape(0)), dof = cell.single.arms[arm].dof;
          std::vector<SegmentResult<float>> results(n);
          {
            nb::gil_scoped_release release;
            std::vector<float> p(from.data(), from.data() + from.size()), q(to.data(), to.data() + to.size());
            Prover<Floats> prover(cell.world<Floats>());
            const auto at = [&](int s) { return std::pair<const float*, const float*>(&p[s * dof], &q[s * dof]); };
            prover.alone(arm, n, at, levels_of(margin, proof), Stop::at_first_contact_of_segment, results.data());
          }
          std::vector<bool> out;
          for (const auto& r : results) out.push_back(r.free);
          return to_numpy<Flags>(out, n);
        },
        nb::arg("cell"), nb::arg("arm"), nb::arg("q_from"), nb::arg("q_to"), nb::arg("margin"), nb::arg("proof"),
        "Whether straight segments keep `proof` [m] at every instant and `margin` [m] where looked at: obstacles, other "
        "bases, self. Limits are the caller's.");

  nb::class_<SearchMotion>(m, "Motion", "One arm's trajectory on the grid of steps, its spheres worked out.")
      .def("__init__",
           [](SearchMotion* self, const Cell& cell, int arm, Matrix q) {
             need_rows(cell, arm, q);
             need(q.shape(0) > 0, "a motion has one step at least");
             nb::gil_scoped_release release;
             new (self) SearchMotion(cell.single, arm, {q.data(), q.data() + q.size()});
           },
           nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::keep_alive<1, 2>())
      .def_ro("arm", &SearchMotion::arm_index)
      .def_ro("last", &SearchMotion::last, "Index of the last step.");

  m.def("conflict_instants",
        [](const Cell& cell, const std::vector<const SearchMotion*>& motions, Pairs pairs, double margin, double proof) {
          const int n = static_cast<int>(pairs.shape(0)), count = static_cast<int>(motions.size());
          for (int k = 0; k < 2 * n; ++k) need(pairs.data()[k] >= 0 && pairs.data()[k] < count, "no such motion");
          std::vector<std::vector<double>> found(n);
          {
            nb::gil_scoped_release release;
            PairCheck<Floats> check(cell.world<Floats>());
            for (int k = 0; k < n; ++k)
              check(*motions[pairs.data()[2 * k]], *motions[pairs.data()[2 * k + 1]], levels_of(margin, proof), found[k]);
          }
          nb::list out;
          for (auto& steps : found) {
            const size_t size = steps.size();
            out.append(to_numpy<Out1>(std::move(steps), size));
          }
          return out;
        },
        nb::arg("cell"), nb::arg("motions"), nb::arg("pairs"), nb::arg("margin"), nb::arg("proof"),
        nb::sig("def conflict_instants(cell: Cell, motions: collections.abc.Sequence[Motion], pairs: numpy.ndarray, margin: "
                "float, proof: float) -> list[numpy.ndarray]"),
        "For each pair of motions the instants of conflict, in steps, ascending: whole where surfaces are closer than "
        "`margin` [m] at a step, broken for a contact found between two. Elsewhere `proof` [m] is proved to be kept at "
        "every instant. A motion stays at its last step for ever.");

  nb::class_<SearchConstraint>(m, "Constraint", "What one arm must not do in the window (start, end) of steps.")
      .def_static("ball",
                  [](Vector center, double radius, int start, int end) {
                    return SearchConstraint::ball(as<float>(center), float(radius), start, end);
                  },
                  nb::arg("center"), nb::arg("radius"), nb::arg("start"), nb::arg("end"),
                  "Being within `radius` [rad] of a configuration in every joint.")
      .def_static("standing",
                  [](const Cell& cell, int arm, Vector q, double shrink, int start, int end) {
                    need_joints(cell, arm, q);
                    return SearchConstraint::standing(cell.single.arms[arm], as<float>(q).data(), float(shrink), start, end);
                  },
                  nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("shrink"), nb::arg("start"), nb::arg("end"),
                  nb::keep_alive<0, 1>(), "Touching another arm as it stands at q, its spheres smaller by `shrink` [m].")
      .def_static("sphere",
                  [](Vector center, double radius, int first_link, int start, int end) {
                    need(center.shape(0) == 3 && first_link > 0, "a point, and a link that moves");
                    return SearchConstraint::ball_in_space(as<float>(center).data(), float(radius), first_link, start, end);
                  },
                  nb::arg("center"), nb::arg("radius"), nb::arg("first_link"), nb::arg("start"), nb::arg("end"),
                  "Links from `first_link` on touching a sphere in the world.")
      .def_ro("start", &SearchConstraint::from)
      .def_ro("end", &SearchConstraint::until);

  m.def("safe_intervals",
        [](const Cell& cell, int arm, Vector q, const std::vector<SearchConstraint*>& constraints, double margin,
           double proof) {
          need_joints(cell, arm, q);
          std::vector<std::pair<int, int>> out;
          {
            nb::gil_scoped_release release;
            const std::vector<float> max_step(cell.single.arms[arm].dof, 1.0f), at = as<float>(q);
            EdgeMaker<Floats> maker(cell.world<Floats>(), arm, constraints, levels_of(margin, proof), max_step.data());
            std::vector<std::pair<int, int>> windows;
            maker.standing(at.data(), windows);
            out = safe_intervals(std::move(windows));
          }
          std::vector<int32_t> flat;
          for (const auto& [lo, hi] : out) flat.insert(flat.end(), {lo, hi});
          return to_numpy<Windows>(flat, out.size(), 2);
        },
        nb::arg("cell"), nb::arg("arm"), nb::arg("q"), nb::arg("constraints"), nb::arg("margin"), nb::arg("proof"),
        "Whole steps [lo, hi] between which the arm may stand at q, [m, 2]; the last may end at FOREVER.");

  nb::class_<SearchArm>(m, "SingleArm", "Plans one arm in space and time (SI-RRT*); keeps what does not depend on constraints.")
      .def("__init__",
           [](SearchArm* self, const Cell& cell, int arm, Vector start, Vector goal, Vector max_step, double margin,
              double proof, uint64_t seed) {
             need_joints(cell, arm, start);
             need_joints(cell, arm, goal);
             need_joints(cell, arm, max_step);
             new (self) SearchArm(*cell.world_planning, arm, as<float>(start).data(), as<float>(goal).data(),
                                  as<float>(max_step).data(), levels_of(margin, proof), seed);
           },
           nb::arg("cell"), nb::arg("arm"), nb::arg("start"), nb::arg("goal"), nb::arg("max_step"), nb::arg("margin"),
           nb::arg("proof"), nb::arg("seed"), nb::keep_alive<1, 2>())
      .def("plan",
           [](SearchArm& self, const std::vector<SearchConstraint*>& constraints, uint64_t seed, const Clock& clock,
              int max_iterations, int improve_iterations, int shortcuts, double eta, double goal_bias, int neighbours)
               -> std::pair<nb::object, int> {
             LowLevelPath<float> path;
             {
               nb::gil_scoped_release release;
               path = self.plan(constraints, {max_iterations, improve_iterations, shortcuts, eta, goal_bias, neighbours},
                                seed, clock);
             }
             if (!path.found) return {nb::none(), path.iterations};
             const size_t dof = self.dof();
             return {nb::cast(to_numpy<Out2>(rows_of(path.positions), path.positions.size() / dof, dof)), path.iterations};
           },
           nb::arg("constraints"), nb::arg("seed"), nb::arg("clock"), nb::arg("max_iterations") = 2000,
           nb::arg("improve_iterations") = 0, nb::arg("shortcuts") = 40, nb::arg("eta") = 0.8,
           nb::arg("goal_bias") = 0.1, nb::arg("neighbours") = 6,
           nb::sig("def plan(self, constraints: collections.abc.Sequence[Constraint], seed: int, clock: Clock, "
                   "max_iterations: int = 2000, improve_iterations: int = 0, shortcuts: int = 40, eta: float = 0.8, "
                   "goal_bias: float = 0.1, neighbours: int = 6) -> tuple[numpy.ndarray | None, int]"),
           "Configurations [steps + 1, dof] on the grid, or None, and the iterations that it took.");

  m.def("repulsive_force",
        [](const Cell& cell, const SearchMotion& motion, const std::vector<const SearchMotion*>& others, double k_rep,
           double d0, bool centre_distance) {
          std::vector<float> out;
          {
            nb::gil_scoped_release release;
            RepulsionOptions options;
            options.k_rep = k_rep;
            options.d0 = d0;
            options.centre_distance = centre_distance;
            Repulsion<Floats>(cell.world<Floats>(), options).force(motion, others, out);
          }
          const size_t dof = motion.arm->dof;
          return to_numpy<Out2>(rows_of(out), out.size() / dof, dof);
        },
        nb::arg("cell"), nb::arg("motion"), nb::arg("others"), nb::arg("k_rep"), nb::arg("d0"),
        nb::arg("centre_distance"), "Joint forces J^T F [steps + 1, dof] on the inner steps of a motion.");

  m.def("modify_motion",
        [](const Cell& cell, const SearchMotion& motion, const std::vector<const SearchMotion*>& others,
           const std::vector<SearchConstraint*>& constraints, Vector max_step_rad, double margin, double proof,
           double constraint_margin, const Clock& clock, double alpha, double k_rep, double d0, int max_iterations,
           bool centre_distance, bool normalised, double normalised_step, double max_step, double comfort, bool trace) {
          need_joints(cell, motion.arm_index, max_step_rad);
          Repulsion<Floats>::Result result;
          {
            nb::gil_scoped_release release;
            Repulsion<Floats> repulsion(*cell.world_planning,
                                        repulsion_options(alpha, k_rep, d0, max_iterations, centre_distance, normalised,
                                                          normalised_step, max_step, comfort));
            result = repulsion.modify(motion, others, constraints, as<float>(max_step_rad).data(),
                                      levels_of(margin, proof), float(constraint_margin), trace, clock);
          }
          const size_t dof = motion.arm->dof, rows = result.positions.size() / dof;
          nb::list steps;
          for (auto& t : result.trace) steps.append(to_numpy<Out2>(rows_of(t), rows, dof));
          return nb::make_tuple(to_numpy<Out2>(rows_of(result.positions), rows, dof), result.moved, result.iterations,
                                result.input_breaks_constraint, steps);
        },
        nb::arg("cell"), nb::arg("motion"), nb::arg("others"), nb::arg("constraints"), nb::arg("max_step_rad"),
        nb::arg("margin"), nb::arg("proof"), nb::arg("constraint_margin"), nb::arg("clock"), nb::arg("alpha"),
        nb::arg("k_rep"), nb::arg("d0"), nb::arg("max_iterations"), nb::arg("centre_distance"), nb::arg("normalised"),
        nb::arg("normalised_step"), nb::arg("max_step"), nb::arg("comfort"), nb::arg("trace") = false,
        nb::sig("def modify_motion(cell: Cell, motion: Motion, others: collections.abc.Sequence[Motion], constraints: "
                "collections.abc.Sequence[Constraint], max_step_rad: numpy.ndarray, margin: float, proof: float, "
                "constraint_margin: float, clock: Clock, alpha: float, k_rep: float, d0: float, max_iterations: int, "
                "centre_distance: bool, normalised: bool, normalised_step: float, max_step: float, comfort: float, "
                "trace: bool = False) -> tuple[numpy.ndarray, bool, int, bool, list[numpy.ndarray]]"),
        "ModifyMotion: (positions, moved, iterations, whether the input broke a constraint, iterates if traced).");

  m.def("breaks_constraint",
        [](const Cell& cell, const SearchMotion& motion, const std::vector<SearchConstraint*>& constraints, double margin) {
          nb::gil_scoped_release release;
          return Repulsion<Floats>(cell.world<Floats>(), {}).broken(motion, constraints, float(margin));
        },
        nb::arg("cell"), nb::arg("motion"), nb::arg("constraints"), nb::arg("margin"),
        "Whether a motion comes closer than `margin` [m] to what its constraints forbid, within their windows.");

  m.def("certify",
        [](const Cell& cell, const std::vector<Matrix>& q, double required, double slack, const Clock& clock) {
          need(!q.empty() && q.size() == cell.precise.arms.size(), "one array of configurations for each arm");
          std::vector<const double*> rows;
          for (size_t a = 0; a < q.size(); ++a) {
            need_rows(cell, static_cast<int>(a), q[a]);
            need(q[a].shape(0) == q[0].shape(0) && q[0].shape(0) > 0, "as many rows for each arm");
            rows.push_back(q[a].data());
          }
          Proof proof;
          {
            nb::gil_scoped_release release;
            proof = Certifier<Doubles>(cell.world<Doubles>(), rows, static_cast<int>(q[0].shape(0))).run(required, slack, clock);
          }
          return nb::make_tuple(proof.valid, proof.clearance, proof.arm_a, proof.arm_b, proof.step, proof.fraction);
        },
        nb::arg("cell"), nb::arg("q"), nb::arg("required"), nb::arg("slack"), nb::arg("clock"),
        nb::sig("def certify(cell: Cell, q: collections.abc.Sequence[numpy.ndarray], required: float, slack: float, clock: "
                "Clock) -> tuple[bool, float, int, int, int, float]"),
        "Proves a clearance [m] of all bodies along q [n, dof] per arm, linear in between: (valid, clearance, arm, other "
        "arm or -1, segment, fraction of it).");
}
