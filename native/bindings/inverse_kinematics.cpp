#include "bindings/bindings.hpp"
#include "ik/refinement.hpp"
#include "ik/self_motion.hpp"
#include "ik/six_hinges.hpp"
#include "ik/turns.hpp"

namespace mmp {
namespace {

using Numbers3 = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

constexpr int kMaxTurns = 64;  // of one hinge
constexpr double kTurn = 2 * std::numbers::pi;

ik::Vec vec(const double* p) { return {p[0], p[1], p[2]}; }

ik::Rotation rotation_of(const double* p) {
  ik::Rotation out;
  std::copy(p, p + 9, out.rows.begin());
  return out;
}

// Reads a homogeneous matrix [4, 4].
ik::ToolPose tool_pose(const double* p) {
  return {{{p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]}}, {p[3], p[7], p[11]}};
}

ik::Chain chain_of(const Matrix& axes, const Matrix& offsets, const Booleans& slides, const Matrix& tool) {
  const size_t dof = axes.shape(0);
  require(dof > 0 && dof <= kMaxDof && axes.shape(1) == 3, "axes are [1 to 16, 3]");
  require(offsets.shape(0) == dof + 1 && offsets.shape(1) == 3, "offsets are one more than axes");
  require(slides.shape(0) == dof, "slides are one a joint");
  require(tool.shape(0) == 3 && tool.shape(1) == 3, "the tool is a rotation matrix");
  require_lengths(axes.data(), axes.size());
  require_lengths(offsets.data(), offsets.size());
  require_lengths(tool.data(), tool.size());
  ik::Chain out;
  double length = 0;
  for (size_t k = 0; k < dof; ++k) out.axes.push_back(vec(axes.data() + 3 * k)), out.slides.push_back(slides.data()[k]);
  for (size_t k = 0; k <= dof; ++k) {
    out.offsets.push_back(vec(offsets.data() + 3 * k));
    if (k > 0) length += ik::length(out.offsets[k]);
  }
  out.tool = rotation_of(tool.data());
  out.scale = std::max(length, 0.1);
  return out;
}

std::pair<Out2, Windows> to_rows(const std::vector<std::vector<double>>& rows, const std::vector<int>& owners,
                                 size_t dof) {
  std::vector<double> values;
  for (const auto& row : rows) values.insert(values.end(), row.begin(), row.end());
  return {to_numpy<Out2>(std::move(values), rows.size(), dof), to_numpy<Windows>(owners, owners.size(), 1)};
}

}  // namespace

void bind_inverse_kinematics(nb::module_& m) {
  m.def(
      "solve_six_hinges",
      [](Numbers3 axes, Numbers3 offsets, Numbers3 poses, bool spherical, double miss) {
        const size_t n = axes.shape(0);
        require(axes.shape(1) == 6 && axes.shape(2) == 3, "axes are [n, 6, 3]");
        require(offsets.shape(0) == n && offsets.shape(1) == 7 && offsets.shape(2) == 3, "offsets are [n, 7, 3]");
        require(poses.shape(0) == n && poses.shape(1) == 4 && poses.shape(2) == 4, "poses are [n, 4, 4]");
        for (const auto* part : {&axes, &offsets, &poses}) require_lengths(part->data(), part->size());
        checked_size(miss);
        std::vector<std::vector<double>> rows;
        std::vector<int> owners;
        {
          nb::gil_scoped_release release;
          std::vector<ik::Six> found;
          for (size_t k = 0; k < n; ++k) {
            const auto pose = tool_pose(poses.data() + 16 * k);
            ik::SixHinges arm{{}, {}, pose.rotation, pose.position};
            for (int j = 0; j < 6; ++j) arm.axes[j] = vec(axes.data() + 18 * k + 3 * j);
            for (int j = 0; j < 7; ++j) arm.offsets[j] = vec(offsets.data() + 21 * k + 3 * j);
            found.clear();
            spherical ? ik::spherical_wrist(arm, miss, found) : ik::parallel_axes(arm, found);
            for (const auto& q : found) {
              if (!all_within(q.data(), 6, kMaxJoint)) continue;
              rows.emplace_back(q.begin(), q.end());
              owners.push_back(static_cast<int>(k));
            }
          }
        }
        return to_rows(rows, owners, 6);
      },
      nb::arg("axes"), nb::arg("offsets"), nb::arg("poses"), nb::arg("spherical"), nb::arg("miss"),
      "Returns joint angles [m, 6] [rad] near solutions of chains of six hinges, and the index of the chain of each "
      "[m, 1]. axes [n, 6, 3], offsets [n, 7, 3]: at zero positions. poses [n, 4, 4]: of the last frame, which is "
      "parallel to the base frame at zero positions. spherical: whether the last three axes meet; otherwise axes 2 to "
      "4 are parallel, and axes 5 and 6 meet. miss: largest error of the position of a spherical wrist [arm lengths].");

  m.def(
      "refine_tool_pose",
      [](Matrix axes, Matrix offsets, Booleans slides, Matrix tool, int rows, Matrix q, Numbers3 poses, int steps,
         double farthest) {
        const auto chain = chain_of(axes, offsets, slides, tool);
        require(rows == 3 || rows == 5 || rows == 6, "a task has 3, 5 or 6 rows");
        require_configurations(q, chain.dof());
        const size_t n = q.shape(0), dof = q.shape(1);
        require(poses.shape(0) == n && poses.shape(1) == 4 && poses.shape(2) == 4, "poses are [n, 4, 4]");
        require_lengths(poses.data(), poses.size());
        const ik::RefinementSettings settings{.steps = checked_count(steps), .farthest = checked_size(farthest)};
        std::vector<std::vector<double>> refined;
        std::vector<int> owners;
        {
          nb::gil_scoped_release release;
          const ik::ToolTask task{chain, rows};
          std::vector<double> row(dof);
          for (size_t k = 0; k < n; ++k) {
            row.assign(q.data() + k * dof, q.data() + (k + 1) * dof);
            if (!ik::refine(task, tool_pose(poses.data() + 16 * k), settings, row.data())) continue;
            refined.push_back(row);
            owners.push_back(static_cast<int>(k));
          }
        }
        return to_rows(refined, owners, dof);
      },
      nb::kw_only(), nb::arg("axes"), nb::arg("offsets"), nb::arg("slides"), nb::arg("tool"), nb::arg("rows"),
      nb::arg("q"), nb::arg("poses"), nb::arg("steps"), nb::arg("farthest"),
      "Returns the configurations [m, dof] that the Levenberg-Marquardt method brings to their poses, and their "
      "indices "
      "[m, 1]. axes [dof, 3], offsets [dof + 1, 3], tool [3, 3]: the chain at zero positions. rows: 3 for a position, "
      "5 "
      "with the tool's z axis, 6 with its rotation. q [n, dof] [rad or m]. poses [n, 4, 4]. steps: largest number of "
      "steps. farthest: largest error to begin with [rad, or arm lengths].");

  m.def(
      "self_motions",
      [](Matrix axes, Matrix offsets, Booleans slides, Matrix tool, int rows, Matrix q, Matrix pose, Vector lower,
         Vector upper, double step) {
        const auto chain = chain_of(axes, offsets, slides, tool);
        require(rows == 3 || rows == 5 || rows == 6, "a task has 3, 5 or 6 rows");
        require(chain.dof() == rows + 1, "a chain has one joint more than its task has rows");
        require_configurations(q, chain.dof());
        require(pose.shape(0) == 4 && pose.shape(1) == 4, "a pose is [4, 4]");
        require_lengths(pose.data(), pose.size());
        for (const auto* part : {&lower, &upper}) {
          require(part->shape(0) == static_cast<size_t>(chain.dof()), "wrong number of joints");
          require(all_within(part->data(), part->size(), kMaxJoint), "limits must be finite, and within 1e4 rad");
        }
        require(step >= 1e-3 && step <= 1, "a step must be from 1e-3 to 1 rad");
        const ik::ToolTask task{chain, rows};
        ik::SelfMotion curves(task, tool_pose(pose.data()), as<double>(lower), as<double>(upper), step);
        {
          nb::gil_scoped_release release;
          for (const auto& row : separate_rows<double>(q)) curves.add(row);
        }
        return to_rows(curves.inside(), {}, chain.dof()).first;
      },
      nb::kw_only(), nb::arg("axes"), nb::arg("offsets"), nb::arg("slides"), nb::arg("tool"), nb::arg("rows"),
      nb::arg("q"), nb::arg("pose"), nb::arg("lower"), nb::arg("upper"), nb::arg("step"),
      "Returns configurations [m, dof] within the limits on the curves through others, so that neighbours on a curve "
      "are at most a step apart. axes, offsets, slides, tool, rows: as of refine_tool_pose; the chain has one joint "
      "more than rows. q [n, dof] [rad or m]: with the tool at the pose [4, 4]. step: over all joints together [rad].");

  m.def(
      "with_turns",
      [](Matrix q, Vector lower, Vector upper, Booleans hinges, Vector near, int limit) {
        const size_t n = q.shape(0), dof = q.shape(1);
        require(dof > 0 && dof <= kMaxDof && n <= kMaxRows, "configurations have 1 to 16 joints");
        for (const auto* part : {&lower, &upper, &near}) {
          require(part->shape(0) == dof, "wrong number of joints");
          require(all_within(part->data(), dof, kMaxJoint), "joints must be finite, and within 1e4 rad");
        }
        require(hinges.shape(0) == dof, "hinges are one a joint");
        require_configurations(q, static_cast<int>(dof));
        std::vector<int> turns(dof, 0);
        for (size_t k = 0; k < dof; ++k) {
          const double most = std::floor((upper.data()[k] - lower.data()[k]) / kTurn + 1e-6);
          require(most < kMaxTurns, "a hinge has at most 64 turns");
          if (hinges.data()[k]) turns[k] = std::max(static_cast<int>(most), 0);
        }
        checked_count(limit);
        require(limit > 0, "a limit must be positive");
        std::vector<std::vector<double>> rows;
        std::vector<int> owners;
        {
          nb::gil_scoped_release release;
          ik::TurnedRows all(static_cast<int>(dof));
          for (size_t i = 0; i < n; ++i) {
            std::vector<std::vector<ik::Turned>> joints(dof);
            for (size_t k = 0; k < dof; ++k)
              for (int turn = 0; turn <= turns[k]; ++turn) {
                const double position = std::nearbyint((q.data()[i * dof + k] + turn * kTurn) * 1e9) / 1e9;
                if (turn > 0 && position > upper.data()[k] + 1e-9) break;
                const double inside = std::min(position, upper.data()[k]);
                joints[k].push_back({inside, std::abs(inside - near.data()[k])});
              }
            all.add(std::move(joints));
          }
          for (auto& row : all.nearest(limit)) rows.push_back(std::move(row.q)), owners.push_back(row.owner);
        }
        return to_rows(rows, owners, dof);
      },
      nb::arg("q"), nb::arg("lower"), nb::arg("upper"), nb::arg("hinges"), nb::arg("near"), nb::arg("limit"),
      "Returns configurations [m, dof] with all turns of their hinges within the limits, and the index in `q` of each "
      "[m, 1]: the `limit` nearest to `near` by the sum over the joints, the nearest first. q [n, dof]: with the least "
      "turns above the lower limits.");
}

}  // namespace mmp
