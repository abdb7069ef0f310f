#include "bindings/bindings.hpp"
#include "covers/point_groups.hpp"
#include "covers/set_cover.hpp"

namespace mmp {
namespace {

using Numbers1 = nb::ndarray<nb::numpy, int32_t, nb::ndim<1>>;

constexpr size_t kMaxCandidates = 1 << 24;

void require_points(const Matrix& points, const char* message) {
  require(points.shape(1) == 3 && points.shape(0) <= kMaxRows, message);
  require_lengths(points.data(), points.size());
}

covers::PointsAndBalls checked_balls(const Matrix& points, const Matrix& centers, const Vector& radii) {
  require_points(points, "points are [n, 3]");
  require_points(centers, "centers are [s, 3]");
  require(radii.shape(0) == centers.shape(0), "radii are one a center");
  require_lengths(radii.data(), radii.size());
  return {points.data(), points.shape(0), centers.data(), radii.data(), radii.shape(0)};
}

void require_numbers(const Indices& numbers, size_t count, const char* message) {
  require(std::all_of(numbers.data(), numbers.data() + numbers.size(),
                      [=](int32_t k) { return k >= 0 && static_cast<size_t>(k) < count; }),
          message);
}

std::span<const int32_t> span_of(const Indices& numbers) { return {numbers.data(), numbers.size()}; }

Numbers1 to_numbers(covers::Numbers values) {
  const size_t count = values.size();
  return to_numpy<Numbers1>(std::move(values), count);
}

}  // namespace

void bind_covers(nb::module_& m) {
  m.def(
      "deepest_balls",
      [](Matrix points, Matrix centers, Vector radii) {
        const auto all = checked_balls(points, centers, radii);
        covers::Numbers ball(all.n, 0);
        std::vector<double> outside(all.n, std::numeric_limits<double>::infinity());
        {
          nb::gil_scoped_release release;
          covers::deepest_balls(all, ball.data(), outside.data());
        }
        return std::pair{to_numbers(std::move(ball)), to_numpy<Out1>(std::move(outside), all.n)};
      },
      nb::arg("points"), nb::arg("centers"), nb::arg("radii"),
      "Returns the ball in which each point [n, 3] [m] lies deepest, the first of several, and how far [m] the point "
      "is outside it.");

  m.def(
      "points_in_balls",
      [](Matrix points, Vector depth, Matrix centers, Vector radii) {
        const auto all = checked_balls(points, centers, radii);
        require(depth.shape(0) == all.n, "depths are one a point");
        require_lengths(depth.data(), depth.size());
        std::pair<covers::Numbers, covers::Numbers> found;
        {
          nb::gil_scoped_release release;
          found = covers::points_in_balls(all, depth.data());
        }
        return std::pair{to_numbers(std::move(found.first)), to_numbers(std::move(found.second))};
      },
      nb::arg("points"), nb::arg("depth"), nb::arg("centers"), nb::arg("radii"),
      "Returns which points [n, 3] [m] lie at least `depth` [n] [m] deep in which balls: numbers of both, in ascending "
      "order.");

  m.def(
      "plane_depths",
      [](Matrix points, Matrix planes) {
        require_points(points, "points are [n, 3]");
        require(planes.shape(0) > 0 && planes.shape(1) == 4, "planes are [1 or more, 4]");
        require_lengths(planes.data(), planes.size());
        std::vector<double> depth(points.shape(0));
        {
          nb::gil_scoped_release release;
          covers::plane_depths(points.data(), points.shape(0), planes.data(), planes.shape(0), depth.data());
        }
        return to_numpy<Out1>(std::move(depth), points.shape(0));
      },
      nb::arg("points"), nb::arg("planes"),
      "Returns how deep [n] [m] points [n, 3] [m] lie inside half-spaces [p, 4] (n, n.x <= d), negative outside.");

  m.def(
      "small_cover",
      [](Indices samples, Indices candidates, size_t sample_count, size_t candidate_count, Indices chosen,
         Vector draws) {
        require(sample_count <= kMaxRows && candidate_count <= kMaxCandidates, "too many samples or candidates");
        require(samples.size() == candidates.size(), "a covering has a sample and a candidate");
        require_numbers(samples, sample_count, "no such sample");
        require_numbers(candidates, candidate_count, "no such candidate");
        require_numbers(chosen, candidate_count, "no such candidate");
        std::for_each(draws.data(), draws.data() + draws.size(), [](double x) { checked_share(x); });
        covers::Numbers out;
        {
          nb::gil_scoped_release release;
          covers::SetCover cover(span_of(samples), span_of(candidates), sample_count, candidate_count);
          cover.start(span_of(chosen));
          cover.shrink({draws.data(), draws.size()});
          out = cover.chosen();
        }
        return to_numbers(std::move(out));
      },
      nb::kw_only(), nb::arg("samples"), nb::arg("candidates"), nb::arg("sample_count"), nb::arg("candidate_count"),
      nb::arg("chosen"), nb::arg("draws"),
      "Returns few candidates that cover all samples that any candidate covers: candidate candidates[k] covers "
      "samples[k]. "
      "It begins with `chosen`, adds candidates greedily, and makes len(draws) steps of a local search (RWLS), each "
      "with "
      "a random number from 0 to 1.");
}

}  // namespace mmp
