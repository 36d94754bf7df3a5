// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/bound.hpp"

#include <variant>

#include "casters.hpp"
#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Bound = Result<PoseBound>;
using Rows3 = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>;

Bound bound_of_points(const Rows3& points_in_world_m, const Camera& camera,
                      const Rigid3& cam_from_world,
                      const std::variant<double, std::vector<double>>& sigma_px) {
  std::vector<Eigen::Vector3d> points;
  for (Eigen::Index i = 0; i < points_in_world_m.rows(); ++i)
    points.emplace_back(points_in_world_m.row(i));
  return std::visit(
      [&](const auto& sigma) { return pose_bound(points, camera, cam_from_world, sigma); },
      sigma_px);
}

Bound bound_of_scene(const Scene& scene, const Rigid3& cam_from_world, Rung rung, FluxModel flux) {
  py::gil_scoped_release unlocked;
  return pose_bound(scene, cam_from_world, rung, flux);
}

void define_pose_bound(py::module_& m) {
  ResultClass<Bound> bound(
      m, "PoseBound", "Cramer-Rao bound: smallest covariance of any unbiased estimate of a pose.");
  define_result(bound);
  bound
      .def_property_readonly("covariance", value_of(&PoseBound::covariance),
                             "(6, 6) of cam_from_world [rotation rad, translation m], left "
                             "perturbation; infinite without a bound.")
      .def_property_readonly("position_covariance_m2", value_of(&PoseBound::position_covariance_m2),
                             "(3, 3) covariance of the camera's position [m^2, world].")
      .def_property_readonly("rank", value_of(&PoseBound::rank),
                             "Number of determined directions of the pose, 0 to 6.")
      .def_property_readonly("lamps", value_of(&PoseBound::lamps),
                             "Number of lamps or points that contribute.")
      .def("__repr__", [](const Bound& b) {
        const double sigma_m = std::sqrt(b->position_covariance_m2.trace());
        return "<PoseBound: " + std::string(to_string(b.status)) + ", position " +
               value_repr(sigma_m) + " m>";
      });
}

}  // namespace

void define_bound(py::module_& m) {
  define_pose_bound(m);
  m.def(
      "pose_bound", &bound_of_scene, py::arg("scene"), py::arg("cam_from_world"),
      py::arg("rung") = Rung::direct, py::arg("flux") = FluxModel::ignore,
      R"(Computes the Cramer-Rao bound of the pose from an image of the scene, predicted with its noise.

cam_from_world: pose, 4x4. rung: observations that the bound refers to; direct: all pixels around
the lamps. flux: FluxModel, prior knowledge of the lamps' powers.
Returns: PoseBound; without a bound its status is too_few_lamps or degenerate.
Raises: ValueError if the pose is not a rigid transform or the scene is invalid.
Source: Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, eq. (3.31).)");
  m.def("pose_bound", &bound_of_points, py::arg("points_in_world_m"), py::arg("camera"),
        py::arg("cam_from_world"), py::arg("sigma_px"),
        R"(Computes the Cramer-Rao bound of the pose from image points with independent errors.

points_in_world_m: (n, 3). cam_from_world: pose, 4x4. sigma_px: standard deviation of each pixel
coordinate, one number or one for each point. Points outside the lens model are ignored.
Returns: PoseBound; without a bound its status is too_few_lamps or degenerate.
Raises: ValueError for counts that differ or numbers that are not finite.)");
}

}  // namespace occ::python
