// Bindings check only what would crash. Messages, shapes and allocation belong to Python (mmp_env/model/collision.py).
#include "bindings/bindings.hpp"

using namespace mmp;

namespace {

// Lets Python run its signal handlers during a long call, at most every 20 ms.
void poll_signals(const Clock& clock, Clock::Steady::time_point now) {
  if (!clock.due(now, std::chrono::milliseconds(20))) return;
  nb::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

int cpu_level() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  // Tests features, because Clang before 17 does not know the level names.
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
  m.doc() =
      "Native core of mmp-env: kinematics, clearance, proofs, single-arm search and repulsion. Arrays are float64.";
  nb::set_leak_warnings(false);  // objects alive at interpreter exit do not concern the user
  m.attr("LANES") = MMP_LANES;
  m.attr("FOREVER") = kForever;
  m.def("cpu_level", &cpu_level, "The x86-64 level (1, 3 or 4) that this processor supports; 1 elsewhere.");

  nb::class_<Clock>(m, "Clock",
                    "Deadline in seconds from now, and a cancel flag. Long calls observe both, and Python signals.")
      .def(
          "__init__",
          [](Clock* self, double seconds) {
            require(!std::isnan(seconds), "seconds must be a number");
            new (self) Clock(seconds);
            self->poll_ = poll_signals;
          },
          nb::arg("seconds"))
      .def("cancel", &Clock::cancel, "Ends every call that uses this clock, from any thread.")
      .def_prop_ro(
          "expired", [](const Clock& c) { return c.cancelled() || c.remaining() <= 0; },
          "Whether the deadline has passed or the clock was cancelled.")
      .def_prop_ro("remaining", &Clock::remaining, "Time left [s].")
      .def(
          "reserve",
          [](Clock& self, double seconds) {
            require(!std::isnan(seconds), "seconds must be a number");
            self.reserve(seconds);
          },
          nb::arg("seconds"), "Lets the clock expire earlier by a time [s], which replaces an earlier reserve.");

  nb::class_<Levels<double>>(
      m, "Levels",
      "Distances between surfaces [m]. Closer than `margin` at a sample is a contact; `proof` is proved at every "
      "instant. "
      "Both hold between two arms. `obstacles` is added for an arm and an obstacle, `own` for two parts of one arm, "
      "`upright` for the room of an upright tool.")
      .def(
          "__init__",
          [](Levels<double>* self, double margin, double proof, double obstacles, double own, double upright) {
            new (self) Levels<double>{checked_number(margin), checked_number(proof), checked_number(obstacles),
                                      checked_number(own), checked_number(upright)};
          },
          nb::arg("margin"), nb::arg("proof"), nb::arg("obstacles") = 0.0, nb::arg("own") = 0.0,
          nb::arg("upright") = 0.0)
      .def_ro("margin", &Levels<double>::margin)
      .def_ro("proof", &Levels<double>::proof)
      .def_ro("obstacles", &Levels<double>::obstacles)
      .def_ro("own", &Levels<double>::self)
      .def_ro("upright", &Levels<double>::upright);

  bind_cell(m);
  bind_hulls(m);
  bind_queries(m);
  bind_upright(m);
  bind_motion(m);
  bind_single_arm(m);
  bind_repulsion(m);
  bind_joint_space(m);
  bind_improve(m);
  bind_inverse_kinematics(m);
  bind_covers(m);
}
