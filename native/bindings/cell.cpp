#include "bindings/bindings.hpp"

namespace mmp {

namespace {

template <class T>
void add_arm(CellModel<T>& cell, const Matrix& fixed, const Vector& tool, const Booleans& slides, const Vector& lower,
             const Vector& upper, const Indices& link_frames, const Matrix& spheres, const Indices& sphere_links,
             const Pairs& self_pairs) {
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
  for (int j = 0; j < arm.dof; ++j) arm.turns.push_back(slides.data()[j] ? T(0) : T(1));
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

// The bounds on motion need the largest travel.
void require_slide(double lower, double upper) {
  require(lower > -kMaxLength && upper < kMaxLength, "a slide's limits must be within 1e6 m");
}

void require_chain(const Matrix& fixed, const Vector& tool, const Booleans& slides, const Vector& lower,
                   const Vector& upper) {
  const size_t dof = fixed.shape(0);
  require(dof > 0 && dof <= kMaxDof, "an arm has 1 to 16 joints");
  require(fixed.shape(1) == 12 && tool.shape(0) == 12, "a pose of an arm has 12 numbers");
  require_lengths(fixed.data(), fixed.size());
  require_lengths(tool.data(), tool.size());
  require(slides.shape(0) == dof && lower.shape(0) == dof && upper.shape(0) == dof, "a kind and limits for each joint");
  for (size_t k = 0; k < dof; ++k) {
    require(lower.data()[k] <= upper.data()[k], "a joint's limits must be in order");
    if (slides.data()[k]) require_slide(lower.data()[k], upper.data()[k]);
  }
}

void require_links(int dof, const Indices& frames, const Matrix& spheres, const Indices& sphere_links) {
  const size_t links = frames.shape(0), count = spheres.shape(0);
  require(links > 1 && links <= kMaxLinks, "an arm has a base, and 1 to 17 parts that move");
  require(frames.data()[0] == 0, "the first link is the base, in frame 0");
  for (size_t l = 1; l < links; ++l)
    require(frames.data()[l] >= std::max(1, frames.data()[l - 1]) && frames.data()[l] <= dof,
            "links move with frames 1 to the number of joints, in order");
  require(spheres.shape(1) == 4 && sphere_links.shape(0) == count, "a sphere has 4 numbers and a link");
  require_lengths(spheres.data(), spheres.size());
  for (size_t s = 0; s < count; ++s) {
    require(spheres.data()[4 * s + 3] >= 0, "a radius must not be negative");
    require(sphere_links.data()[s] >= 0 && sphere_links.data()[s] < static_cast<int>(links), "a sphere of no link");
  }
}

// A self-pair proof follows the chain from the first link to the second.
void require_pairs(const Indices& frames, const Pairs& pairs) {
  const int links = static_cast<int>(frames.shape(0));
  for (size_t k = 0; k < pairs.shape(0); ++k) {
    const int i = pairs.data()[2 * k], j = pairs.data()[2 * k + 1];
    require(i >= 0 && i < j && j < links, "self_pairs are links of the arm, the one nearer to the base first");
  }
}

ConvexHull hull_of(Shape shape, const double* size) {
  const double a = size[0], b = size[1], c = size[2];
  switch (shape) {
    case Shape::box:
      return {{{a, b, c}, {a, b, -c}, {a, -b, c}, {a, -b, -c}, {-a, b, c}, {-a, b, -c}, {-a, -b, c}, {-a, -b, -c}}, 0};
    case Shape::cylinder:
      return {{{0, 0, b}, {0, 0, -b}}, 0, a};
    case Shape::capsule:
      return {{{0, 0, b}, {0, 0, -b}}, a};
    default:
      return {{{0, 0, 0}}, a};
  }
}

template <class T>
Obstacle<T> obstacle_of(int shape, const Vector& pose, const Vector& size) {
  Obstacle<T> o;
  o.shape = static_cast<Shape>(shape);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) o.pose.r[3 * i + j] = T(pose.data()[4 * i + j]);
    o.pose.p[i] = T(pose.data()[4 * i + 3]);
  }
  o.a = T(size.data()[0]);
  o.b = T(size.data()[1]);
  o.c = T(size.data()[2]);
  o.exact = {std::make_shared<ConvexHull>(hull_of(o.shape, size.data()))};
  return o;
}

void require_obstacle(int shape, const Vector& pose, const Vector& size) {
  require(shape >= 0 && shape <= static_cast<int>(Shape::capsule), "no such shape");
  require(pose.shape(0) == 12 && size.shape(0) == 3, "an obstacle has a pose of 12 numbers and a size of 3");
  require_lengths(pose.data(), 12);
  require_lengths(size.data(), 3);
  require(std::all_of(size.data(), size.data() + 3, [](double x) { return x >= 0; }),
          "the size of an obstacle must not be negative");
}

template <class T>
void add_hull(ArmModel<T>& arm, int link, const std::shared_ptr<const ConvexHull>& hull, double protrusion) {
  auto& to = arm.links[link];
  if (to.hulls.count == 0) to.hulls.first = static_cast<int>(arm.hulls.size());
  to.protrusion = to.hulls.count == 0 ? T(protrusion) : std::max(to.protrusion, T(protrusion));
  ++to.hulls.count;
  arm.hulls.push_back(hull);
}

template <class T>
void add_hull_obstacle(CellModel<T>& cell, const Matrix& planes, const std::shared_ptr<const ConvexHull>& hull) {
  Obstacle<T> o{Shape::hull, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, 0, 0, 0};
  for (size_t k = 0; k < planes.shape(0); ++k) {
    const double* p = planes.data() + 4 * k;
    o.planes.push_back({T(p[0]), T(p[1]), T(p[2]), T(p[3] + hull->radius)});
  }
  o.exact = {hull};
  cell.obstacles.push_back(std::move(o));
}

template <class T>
void let_touch(Obstacle<T>& obstacle, int arm, int link) {
  if (static_cast<int>(obstacle.allowed.size()) <= arm) obstacle.allowed.resize(arm + 1);
  obstacle.allowed[arm] |= 1u << link;
}

}  // namespace

Obstacle<double> checked_obstacle(int shape, const Vector& pose, const Vector& size) {
  require_obstacle(shape, pose, size);
  return obstacle_of<double>(shape, pose, size);
}

void bind_cell(nb::module_& m) {
  nb::class_<Cell>(m, "Cell", "Arms and obstacles of a cell. Add all of them, then freeze it.")
      .def(nb::init<>())
      .def(
          "add_arm",
          [](Cell& self, Matrix fixed, Vector tool, Booleans slides, Vector lower, Vector upper, Indices link_frames,
             Matrix spheres, Indices sphere_links, Pairs self_pairs) {
            require(!self.frozen, "the cell is frozen");
            require_chain(fixed, tool, slides, lower, upper);
            require_links(static_cast<int>(fixed.shape(0)), link_frames, spheres, sphere_links);
            require_pairs(link_frames, self_pairs);
            add_arm(self.single, fixed, tool, slides, lower, upper, link_frames, spheres, sphere_links, self_pairs);
            add_arm(self.precise, fixed, tool, slides, lower, upper, link_frames, spheres, sphere_links, self_pairs);
          },
          nb::kw_only(), nb::arg("fixed"), nb::arg("tool"), nb::arg("slides"), nb::arg("lower"), nb::arg("upper"),
          nb::arg("link_frames"), nb::arg("spheres"), nb::arg("sphere_links"), nb::arg("self_pairs"),
          "Adds an arm. fixed [dof, 12]: rows of T_frame(k)_frame(k+1) at q = 0, joint axis z, the first frame in the "
          "world. slides [dof]: whether a joint moves along the axis [m] instead of turning about it [rad]. spheres "
          "[s, 4]: centre and radius in the frame of their link, the base's (link 0) in the world. "
          "self_pairs [p, 2]: links that must not touch, the one nearer to the base first.")
      .def(
          "add_obstacle",
          [](Cell& self, int shape, Vector pose, Vector size) {
            require(!self.frozen, "the cell is frozen");
            require_obstacle(shape, pose, size);
            self.single.obstacles.push_back(obstacle_of<float>(shape, pose, size));
            self.precise.obstacles.push_back(obstacle_of<double>(shape, pose, size));
          },
          nb::arg("shape"), nb::arg("pose"), nb::arg("size"),
          "Adds an obstacle. shape: 0 box, 1 sphere, 2 cylinder, 3 capsule. pose [12]: rows of T_world_obstacle. size "
          "[3] [m]: half edges of a box; radius and half length of other shapes.")
      .def(
          "add_hull",
          [](Cell& self, int arm, int link, Matrix vertices, double radius, double protrusion) {
            require(!self.frozen, "the cell is frozen");
            require(arm >= 0 && arm < static_cast<int>(self.single.arms.size()), "no such arm");
            const auto& links = self.single.arms[arm].links;
            require(link >= 0 && link < static_cast<int>(links.size()), "no such link");
            for (size_t later = static_cast<size_t>(link) + 1; later < links.size(); ++later)
              require(links[later].hulls.count == 0, "the hulls of an arm come in the order of its links");
            require(protrusion >= 0 && protrusion <= kUnknownProtrusion, "protrusion must be 0 to 1e9 m");
            const auto hull = self.hull(checked_vertices(vertices, radius), radius);
            add_hull(self.single.arms[arm], link, hull, protrusion);
            add_hull(self.precise.arms[arm], link, hull, protrusion);
          },
          nb::kw_only(), nb::arg("arm"), nb::arg("link"), nb::arg("vertices"), nb::arg("radius") = 0.0,
          nb::arg("protrusion") = kUnknownProtrusion,
          "Adds a convex hull to a link, in the frame of its spheres, which must cover it. vertices [n, 3] [m], grown "
          "by a ball of `radius` [m]. protrusion [m]: no point of the link's spheres is farther from its hulls. Where "
          "spheres come close, the hulls of two links decide if both have some.")
      .def(
          "add_hull_obstacle",
          [](Cell& self, Matrix vertices, Matrix planes, double radius) {
            require(!self.frozen, "the cell is frozen");
            const auto hull = self.hull(checked_vertices(vertices, radius), radius);
            require(planes.shape(0) > 0 && planes.shape(1) == 4, "a plane has 4 numbers");
            require_lengths(planes.data(), planes.size());
            add_hull_obstacle(self.single, planes, hull);
            add_hull_obstacle(self.precise, planes, hull);
          },
          nb::kw_only(), nb::arg("vertices"), nb::arg("planes"), nb::arg("radius") = 0.0,
          "Adds a convex obstacle. vertices [n, 3] [m] in the world, grown by `radius` [m]. planes [p, 4]: unit "
          "normals and offsets, the hull of the vertices is where n.x <= offset.")
      .def(
          "let_touch",
          [](Cell& self, int obstacle, int arm, int link) {
            require(!self.frozen, "the cell is frozen");
            require(obstacle >= 0 && obstacle < static_cast<int>(self.single.obstacles.size()), "no such obstacle");
            require(arm >= 0 && arm < static_cast<int>(self.single.arms.size()), "no such arm");
            require(link > 0 && link < static_cast<int>(self.single.arms[arm].links.size()), "no such moving link");
            let_touch(self.single.obstacles[obstacle], arm, link);
            let_touch(self.precise.obstacles[obstacle], arm, link);
          },
          nb::kw_only(), nb::arg("obstacle"), nb::arg("arm"), nb::arg("link"),
          "Lets a moving link touch an obstacle: no query tests the two.")
      .def(
          "freeze",
          [](Cell& self) {
            require(!self.frozen, "the cell is frozen");
            require(!self.single.arms.empty(), "a cell has one arm at least");
            self.freeze();
          },
          "Ends the construction. Only a frozen cell answers queries.");
}

}  // namespace mmp
