#include "bindings.hpp"

namespace mmp {

namespace {

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

}  // namespace

void bind_cell(nb::module_& m) {
  nb::class_<Cell>(m, "Cell", "Arms and obstacles; add all of them, then freeze.")
      .def(nb::init<>())
      .def(
          "add_arm",
          [](Cell& self, Matrix fixed, Vector tool, Vector lower, Vector upper,
             nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig> link_frames, Matrix spheres,
             nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig> sphere_links, Pairs self_pairs) {
            need(!self.frozen, "the cell is frozen");
            need(fixed.shape(0) > 0 && fixed.shape(0) <= kMaxDof && link_frames.shape(0) <= kMaxLinks,
                 "an arm has 1 to 16 joints");
            need(fixed.shape(1) == 12 && tool.shape(0) == 12 && spheres.shape(1) == 4 && link_frames.shape(0) > 1 &&
                     sphere_links.shape(0) == spheres.shape(0),
                 "an arm of the wrong shape");
            add_arm(self.single, fixed, tool, lower, upper, link_frames, spheres, sphere_links, self_pairs);
            add_arm(self.precise, fixed, tool, lower, upper, link_frames, spheres, sphere_links, self_pairs);
          },
          nb::arg("fixed"), nb::arg("tool"), nb::arg("lower"), nb::arg("upper"), nb::arg("link_frames"),
          nb::arg("spheres"), nb::arg("sphere_links"), nb::arg("self_pairs"),
          "fixed [dof, 12]: rows of T_frame(k)_frame(k+1) at q = 0, joint axis z, the first one in the world; spheres "
          "[s, 4] in the frame of their link, the base's (link 0) in the world.")
      .def(
          "add_obstacle",
          [](Cell& self, int shape, Vector pose, Vector size) {
            add_obstacle(self.single, shape, pose, size);
            add_obstacle(self.precise, shape, pose, size);
          },
          nb::arg("shape"), nb::arg("pose"), nb::arg("size"))
      .def("freeze", [](Cell& self) {
        need(!self.frozen, "the cell is frozen");
        self.freeze();
      });
}

}  // namespace mmp
