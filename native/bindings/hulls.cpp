#include "bindings/bindings.hpp"
#include "geometry/convex_distance.hpp"

namespace mmp {
namespace {

using Poses = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

RigidPose hull_pose(const double* rows) {
  RigidPose out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.r[3 * i + j] = rows[4 * i + j];
    out.p[i] = rows[4 * i + 3];
  }
  return out;
}

}  // namespace

void bind_hulls(nb::module_& m) {
  m.def(
      "hull_distances",
      [](Matrix a, Matrix b, Poses poses, double radius_a, double radius_b) {
        const ConvexHull hull_a(checked_vertices(a, radius_a), radius_a);
        const ConvexHull hull_b(checked_vertices(b, radius_b), radius_b);
        const size_t n = poses.shape(0), k = poses.shape(1);
        require((k == 2 || k == 4) && poses.shape(2) == 12, "poses are [n, 2 or 4, 12]");
        require_lengths(poses.data(), poses.size());
        const Limits limits = Limits::measure(std::numeric_limits<double>::infinity());
        std::vector<double> out(2 * n);
        {
          nb::gil_scoped_release release;
          for (size_t row = 0; row < n; ++row) {
            const auto posed = [&](const ConvexHull& hull, size_t number) {
              return PosedHull{&hull, hull_pose(poses.data() + (row * k + number) * 12)};
            };
            const auto found =
                k == 2 ? convex_distance(posed(hull_a, 0), posed(hull_b, 1), limits)
                       : swept_distance(posed(hull_a, 0), posed(hull_a, 2), posed(hull_b, 1), posed(hull_b, 3), limits);
            out[2 * row] = found.lower;
            out[2 * row + 1] = found.upper;
          }
        }
        return to_numpy<Out2>(std::move(out), n, 2);
      },
      nb::kw_only(), nb::arg("a"), nb::arg("b"), nb::arg("poses"), nb::arg("radius_a") = 0.0, nb::arg("radius_b") = 0.0,
      "Returns bounds of the distance of two convex hulls [n, 2] [m]: a certified lower one, minus infinity where they "
      "overlap, and an upper one. a, b: vertices [m], grown by balls. poses [n, 2, 12]: rows of the transforms of a "
      "and "
      "b. [n, 4, 12]: also where their points have moved straight to; the bounds then hold for the whole motion.");
}

}  // namespace mmp
