// SPDX-License-Identifier: Apache-2.0
// Smoothers over a whole recording or over the last few frames. Odometry, PlanarOdometry,
// PlanarPose and PoseObservation are defined in motion.cpp.
#include "libocc/smooth/smoother.hpp"

#include <algorithm>
#include <variant>

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/smooth/window_smoother.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using Spatial = Result<Smoothing<SmoothedPose>>;
using Planar = Result<Smoothing<SmoothedPlanarPose>>;
using Numbers = py::array_t<double>;

/// The matrices `of(pose)` of all poses as an array (n, rows, columns).
template <class Poses, class Of>
Numbers stacked(const Poses& poses, const Of& of) {
  using Matrix = std::decay_t<decltype(of(poses[0]))>;
  constexpr py::ssize_t rows = Matrix::RowsAtCompileTime, columns = Matrix::ColsAtCompileTime;
  Numbers out({static_cast<py::ssize_t>(poses.size()), rows, columns});
  double* to = out.mutable_data();
  for (const auto& pose : poses) {
    Eigen::Map<Eigen::Matrix<double, rows, columns, Eigen::RowMajor>> matrix(to);
    matrix = of(pose);
    to += rows * columns;
  }
  return out;
}

template <class Poses, class Of>
Eigen::MatrixXd rows_of_poses(const Poses& poses, const Of& of, Eigen::Index columns) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(poses.size()), columns);
  for (std::size_t k = 0; k < poses.size(); ++k)
    out.row(static_cast<Eigen::Index>(k)) = of(poses[k]).transpose();
  return out;
}

Eigen::Matrix3d position_covariance_of(const SmoothedPose& pose) {
  return pose.determined ? position_covariance(pose.body_from_world, pose.covariance)
                         : unknown_covariance<3>();
}

void define_smoother_frame(py::module_& m) {
  ResultClass<SmootherFrame>(m, "SmootherFrame",
                             R"(Images of identified points in one camera at one time.

Keywords: time_s: time [s]; camera: Camera; points_in_world_m: (n, 3), identified points; points_px:
  (n, 2), their pixels; sigma_px: standard deviation of each pixel coordinate; covariances_px2:
  (n, 2, 2), replaces sigma_px; points_sigma_m: standard deviation of each coordinate of the points,
  one number or (n, 3); 0: exact; cam_from_body: 4x4, mounting of the camera.
Images of the same points, of equal cameras and of equal mountings have the same errors of them.
A frame without points requests the pose at its time. Several frames may have the same time, such as
those of several cameras.
Raises: ValueError for counts that differ, numbers that are not finite, or a sigma that is not
  positive.)")
      .def(py::init([](double time_s, const Camera& camera,
                       const std::optional<Rows3>& points_in_world_m,
                       const std::optional<Rows2>& points_px, double sigma_px,
                       const std::optional<Numbers>& covariances_px2,
                       const std::variant<double, Eigen::MatrixX3d>& points_sigma_m,
                       const Rigid3& cam_from_body) {
             SmootherFrame frame;
             frame.time_s = time_s;
             frame.camera = camera;
             frame.cam_from_body = cam_from_body;
             const Eigen::Index count = points_in_world_m ? points_in_world_m->rows() : 0;
             require((points_px ? points_px->rows() : 0) == count, "points_px",
                     points_px ? points_px->rows() : 0,
                     "as many as points_in_world_m, " + std::to_string(count));
             if (covariances_px2)
               require(covariances_px2->ndim() == 3 && covariances_px2->shape(0) == count &&
                           covariances_px2->shape(1) == 2 && covariances_px2->shape(2) == 2,
                       "covariances_px2", covariances_px2->size(),
                       "of shape (" + std::to_string(count) + ", 2, 2)");
             require(sigma_px > 0, "sigma_px", sigma_px, "positive");
             const auto* each_sigma = std::get_if<Eigen::MatrixX3d>(&points_sigma_m);
             if (each_sigma != nullptr)
               require(each_sigma->rows() == count, "points_sigma_m", each_sigma->rows(),
                       "one number or as many rows as points_in_world_m, " + std::to_string(count));
             const Eigen::MatrixX3d sigmas_m =
                 each_sigma != nullptr
                     ? *each_sigma
                     : Eigen::MatrixX3d::Constant(count, 3, std::get<double>(points_sigma_m));
             for (const double sigma : sigmas_m.reshaped())
               require(sigma >= 0, "points_sigma_m", sigma, "at least 0");
             for (Eigen::Index i = 0; i < count; ++i) {
               PointSighting seen;
               seen.point_in_world = points_in_world_m->row(i);
               seen.px = points_px->row(i);
               seen.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
               if (covariances_px2) {
                 const auto all = covariances_px2->unchecked<3>();
                 seen.covariance_px2 << all(i, 0, 0), all(i, 0, 1), all(i, 1, 0), all(i, 1, 1);
               }
               seen.point_covariance_m2.diagonal() = sigmas_m.row(i).cwiseAbs2();
               frame.sightings.push_back(seen);
             }
             frame.validate();
             return frame;
           }),
           py::kw_only(), py::arg("time_s"),
           py::arg_v("camera", SmootherFrame{}.camera,
                     "Camera.pinhole(width=640, height=480, fx_px=500, fy_px=500, cx_px=319.5, "
                     "cy_px=239.5)"),
           py::arg("points_in_world_m") = py::none(), py::arg("points_px") = py::none(),
           py::arg("sigma_px") = 0.3, py::arg("covariances_px2") = py::none(),
           py::arg("points_sigma_m") = 0.0, py::arg_v("cam_from_body", Rigid3{}, "numpy.eye(4)"))
      .def_readonly("time_s", &SmootherFrame::time_s, "Time [s].")
      .def_readonly("camera", &SmootherFrame::camera, "Camera.")
      .def_readonly("cam_from_body", &SmootherFrame::cam_from_body, "Mounting of the camera, 4x4.")
      .def("__len__", [](const SmootherFrame& frame) { return frame.sightings.size(); })
      .def("__repr__", [](const SmootherFrame& frame) {
        return "<SmootherFrame: " + value_repr(frame.time_s) + " s, sightings " +
               std::to_string(frame.sightings.size()) + ">";
      });

  ResultClass<PlanarPrior>(m, "PlanarPrior", "Prior of a pose on a floor.")
      .def(py::init([](double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance) {
             PlanarPrior prior{time_s, pose, covariance};
             prior.validate();
             return prior;
           }),
           py::kw_only(), py::arg("time_s"), py::arg("pose"), py::arg("covariance"))
      .def_readonly("time_s", &PlanarPrior::time_s, "Time [s].")
      .def_readonly("pose", &PlanarPrior::pose, "PlanarPose.")
      .def_readonly("covariance", &PlanarPrior::covariance, "(3, 3) of [x_m, y_m, heading_rad].");
}

void define_link(py::module_& m) {
  using L = OdometryLink;
  ResultClass<L>(m, "OdometryLink", "Constraint between two consecutive smoothed poses.")
      .def_readonly("from_s", &L::from_s, "Time of the earlier pose [s].")
      .def_readonly("to_s", &L::to_s, "Time of the later pose [s].")
      .def_readonly("odometry", &L::odometry, "False: random walk instead of odometry.")
      .def_readonly("chi2", &L::chi2,
                    "Chi-square of the deleted residual: the step against all other information; "
                    "0 if dof is 0.")
      .def_readonly("dof", &L::dof,
                    "Number of components of the step that the other information determines.")
      .def_readonly("factor", &L::factor, "Factor by which its covariance was inflated.")
      .def_readonly("contradicted", &L::contradicted,
                    "True if the other information contradicts the step.")
      .def("__repr__", [](const L& l) {
        return "<OdometryLink: " + value_repr(l.from_s) + " to " + value_repr(l.to_s) +
               " s, chi2 " + value_repr(l.chi2) + " of " + std::to_string(l.dof) +
               (l.contradicted ? ", contradicted>" : ">");
      });
}

template <class R>
void define_smoothing(ResultClass<R>& cls) {
  define_result(cls);
  using S = std::decay_t<decltype(std::declval<R>().value)>;
  cls.def("__len__", [](const R& r) { return r.value.poses.size(); })
      .def_property_readonly(
          "times_s",
          [](const R& r) {
            Eigen::VectorXd out(static_cast<Eigen::Index>(r.value.poses.size()));
            for (std::size_t k = 0; k < r.value.poses.size(); ++k)
              out[static_cast<Eigen::Index>(k)] = r.value.poses[k].time_s;
            return out;
          },
          "(n,) times of the poses [s].")
      .def_property_readonly(
          "determined",
          [](const R& r) {
            py::array_t<bool> out(static_cast<py::ssize_t>(r.value.poses.size()));
            std::transform(r.value.poses.begin(), r.value.poses.end(), out.mutable_data(),
                           [](const auto& pose) { return pose.determined; });
            return out;
          },
          "(n,) bool: True if a pose is determined; the other poses are undefined.")
      .def_property_readonly("links", value_of(&S::links),
                             "List of OdometryLink between the poses.")
      .def_property_readonly("chi2", value_of(&S::chi2), "Chi-square at the minimum.")
      .def_property_readonly("dof", value_of(&S::dof), "Degrees of freedom of chi2.")
      .def_property_readonly("risk", value_of(&S::risk),
                             "Probability that another minimum that was found is the right one.")
      .def_property_readonly(
          "alternatives",
          [](const R& r) {
            std::vector<R> out;
            for (const auto& other : r.value.alternatives) {
              S whole;
              whole.poses = other.poses;
              whole.chi2 = other.chi2;
              whole.dof = r.value.dof;
              whole.risk = 1 - other.likelihood_ratio * (1 - r.value.risk);
              out.push_back({whole, Status::ambiguous, "another minimum"});
            }
            return out;
          },
          "Other minima, most likely first, if the risk is above 1e-4: each with poses, "
          "covariances, chi2 and risk.")
      .def_property_readonly(
          "sightings", [](const R& r) { return r.value.sightings.count; },
          "Number of image points.")
      .def_property_readonly(
          "beyond", [](const R& r) { return r.value.sightings.beyond; },
          "Number of image points beyond the corner of Huber's loss or outside the camera's "
          "domain.")
      .def_property_readonly(
          "outside", [](const R& r) { return r.value.sightings.outside; },
          "Number of image points outside the camera's domain.")
      .def_property_readonly(
          "rms_px", [](const R& r) { return r.value.sightings.rms_px; },
          "Root mean square residual of the coordinates inside the domain [px].")
      .def_property_readonly("residual_sigmas", value_of(&S::residual_sigmas),
                             "For each frame a list with the residual of each image point, in "
                             "sigmas; infinite outside the domain.")
      .def_property_readonly("iterations", value_of(&S::iterations),
                             "Number of steps of the minimisation.");
}

void define_smoothings(py::module_& m) {
  ResultClass<Spatial> spatial(m, "Smoothing", R"(Poses over time: result of smooth().

If `ok` is false, status and message state the reason; `determined` marks the valid poses.)");
  define_smoothing(spatial);
  spatial
      .def_property_readonly(
          "body_from_world",
          [](const Spatial& r) {
            return stacked(r.value.poses, [](const SmoothedPose& pose) -> Eigen::Matrix4d {
              return pose.body_from_world.matrix();
            });
          },
          "(n, 4, 4) poses.")
      .def_property_readonly(
          "covariances",
          [](const Spatial& r) {
            return stacked(r.value.poses,
                           [](const SmoothedPose& pose) -> Matrix6 { return pose.covariance; });
          },
          "(n, 6, 6) of body_from_world [rotation rad, translation m], left perturbation; the "
          "diagonal is infinite where a pose is not determined.")
      .def_property_readonly(
          "positions_m",
          [](const Spatial& r) {
            return rows_of_poses(
                r.value.poses,
                [](const SmoothedPose& pose) { return pose.body_from_world.origin_in_source(); },
                3);
          },
          "(n, 3) positions of the body [m, world].")
      .def_property_readonly(
          "position_covariances_m2",
          [](const Spatial& r) { return stacked(r.value.poses, &position_covariance_of); },
          "(n, 3, 3) covariances of the positions [m^2, world].")
      .def("__repr__", [](const Spatial& r) {
        return "<Smoothing: " + std::string(to_string(r.status)) + ", poses " +
               std::to_string(r.value.poses.size()) + ">";
      });
  ResultClass<Planar> planar(m, "PlanarSmoothing",
                             "Poses on a floor over time: result of smooth_planar().");
  define_smoothing(planar);
  planar
      .def_property_readonly(
          "poses",
          [](const Planar& r) {
            std::vector<PlanarPose> out;
            for (const auto& pose : r.value.poses) out.push_back(pose.pose);
            return out;
          },
          "List of PlanarPose.")
      .def_property_readonly(
          "covariances",
          [](const Planar& r) {
            return stacked(r.value.poses, [](const SmoothedPlanarPose& pose) -> Eigen::Matrix3d {
              return pose.covariance;
            });
          },
          "(n, 3, 3) of [x_m, y_m, heading_rad]; the diagonal is infinite where a pose is not "
          "determined.")
      .def("__repr__", [](const Planar& r) {
        return "<PlanarSmoothing: " + std::string(to_string(r.status)) + ", poses " +
               std::to_string(r.value.poses.size()) + ">";
      });
}

auto smoother_fields() {
  using O = SmootherOptions;
  return std::make_tuple(
      field("huber_sigmas", &O::huber_sigmas,
            "corner of Huber's loss for image points [sigma]; 0: least squares"),
      field("link_gate", &O::link_gate,
            "probability that a correct odometry step is rejected as a gross error; 0: no test"),
      field("min_odometry_sigma_m", &O::min_odometry_sigma_m,
            "added to each odometry step's position sigmas [m]"),
      field("min_odometry_sigma_rad", &O::min_odometry_sigma_rad,
            "added to each odometry step's rotation sigmas [rad]"),
      field("walk_m", &O::walk_m,
            "random walk without odometry: position sigma after one second, which grows as "
            "sqrt(time) [m]; inf: no constraint"),
      field("walk_rad", &O::walk_rad,
            "random walk without odometry: rotation sigma after one second [rad]"),
      field("mount_sigma_rad", &O::mount_sigma_rad,
            "sigma of each camera's mounting about its axes [rad]"),
      field("mount_sigma_m", &O::mount_sigma_m,
            "sigma of each camera's mounting along its axes [m]"),
      field("clock_sigma_s", &O::clock_sigma_s,
            "sigma of the images' times against those of odometry [s]"),
      field("max_iterations", &O::max_iterations,
            "maximum number of steps in each round of gating"));
}

constexpr const char* smooth_doc =
    R"(Computes the maximum-likelihood poses of a body over a whole recording.

frames: SmootherFrames in the order of time. odometry: Odometry, not overlapping; steps are
concatenated, and cut at the times of frames. observations: PoseObservations, from images or as
priors. start: (4, 4) body_from_world for each pose; None: computed from the frames.
Odometry that contradicts all other information is reported in message and links, and its covariance
is inflated. The time is proportional to the number of poses.
All plausible poses of frames with few lamps are tried. start is one more start value.
Returns: Smoothing. Its status is ambiguous if another minimum is as plausible (`alternatives`);
too_few_lamps if no pose is determined; degenerate if some poses are not determined (message and
`determined` list them); not_converged.
Raises: ValueError for times that decrease, odometry that overlaps, covariances that are not positive
definite, or numbers that are not finite.
Equations and sources: libocc/smooth/smoother.hpp.)";

constexpr const char* smooth_planar_doc =
    R"(Computes the maximum-likelihood poses of a vehicle on a floor, like smooth().

odometry: PlanarOdometry. priors: PlanarPriors. start: PlanarPose for each pose. height_m: height of
the body's origin above the world's z = 0; the body is upright. Returns: PlanarSmoothing.)";

void define_smooth(py::module_& m) {
  const auto fields = smoother_fields();
  define_function(
      m, "smooth", fields,
      [](SmootherOptions options, const std::vector<SmootherFrame>& frames,
         const std::vector<Odometry>& odometry, const std::vector<PoseObservation>& observations,
         const std::optional<std::vector<Rigid3>>& start) {
        py::gil_scoped_release unlocked;
        return smooth({frames, observations, odometry, start.value_or(std::vector<Rigid3>())},
                      options);
      },
      py::arg("frames"), py::arg("odometry") = std::vector<Odometry>(),
      py::arg("observations") = std::vector<PoseObservation>(), py::arg("start") = py::none(),
      py::kw_only(), (smooth_doc + fields_doc(fields, "Options")).c_str());
  define_function(
      m, "smooth_planar", fields,
      [](SmootherOptions options, const std::vector<SmootherFrame>& frames,
         const std::vector<PlanarOdometry>& odometry,
         const std::vector<PoseObservation>& observations, const std::vector<PlanarPrior>& priors,
         const std::optional<std::vector<PlanarPose>>& start, double height_m) {
        py::gil_scoped_release unlocked;
        return smooth_planar({frames, observations, priors, odometry,
                              start.value_or(std::vector<PlanarPose>()), height_m},
                             options);
      },
      py::arg("frames"), py::arg("odometry") = std::vector<PlanarOdometry>(),
      py::arg("observations") = std::vector<PoseObservation>(),
      py::arg("priors") = std::vector<PlanarPrior>(), py::arg("start") = py::none(),
      py::arg("height_m") = 0.0, py::kw_only(),
      (smooth_planar_doc + fields_doc(fields, "Options")).c_str());
}

template <class E, class Whole>
void define_estimate(ResultClass<E>& cls) {
  using W = std::decay_t<decltype(std::declval<E>().value)>;
  define_result(cls);
  cls.def_property_readonly("used", value_of(&W::used),
                            "False if the input was before the window and was ignored.")
      .def_property_readonly(
          "time_s", [](const E& e) { return e.value.newest.time_s; },
          "Time of the newest pose [s].")
      .def_property_readonly(
          "determined", [](const E& e) { return e.value.newest.determined; },
          "True if the newest pose is determined.")
      .def_property_readonly(
          "window",
          [](const E& e) {
            return Whole{e.value.window, e.status, e.message};
          },
          "All poses of the window, oldest first.");
}

void define_estimates(py::module_& m) {
  using S = WindowSmoother::Estimate;
  ResultClass<S> spatial(m, "WindowEstimate", "Newest pose and all poses of a WindowSmoother.");
  define_estimate<S, Spatial>(spatial);
  spatial
      .def_property_readonly(
          "body_from_world", [](const S& e) { return e.value.newest.body_from_world; },
          "Newest pose, 4x4.")
      .def_property_readonly(
          "covariance", [](const S& e) -> Matrix6 { return e.value.newest.covariance; },
          "(6, 6) of the newest body_from_world [rotation rad, translation m], left perturbation.")
      .def_property_readonly(
          "position_m",
          [](const S& e) { return e.value.newest.body_from_world.origin_in_source(); },
          "(3,) newest position of the body [m, world].")
      .def_property_readonly(
          "position_covariance_m2",
          [](const S& e) { return position_covariance_of(e.value.newest); },
          "(3, 3) covariance of this position [m^2, world].");
  using P = PlanarWindowSmoother::Estimate;
  ResultClass<P> planar(m, "PlanarWindowEstimate",
                        "Newest pose and all poses of a PlanarWindowSmoother.");
  define_estimate<P, Planar>(planar);
  planar
      .def_property_readonly(
          "pose", [](const P& e) { return e.value.newest.pose; }, "Newest PlanarPose.")
      .def_property_readonly(
          "covariance", [](const P& e) -> Eigen::Matrix3d { return e.value.newest.covariance; },
          "(3, 3) of [x_m, y_m, heading_rad].");
}

constexpr const char* window_doc =
    R"(Fixed-lag smoother: poses over the last few frames, as frames arrive.

Older poses are marginalised to a prior of the oldest pose in the window, so memory and time per frame
are bounded. Frames inside the window may arrive late; a frame at the time of an existing pose is
treated as a second camera. Status and ValueError as for smooth(), applied to the window.
Source: Sibley, Matthies, Sukhatme, J. Field Robotics 27(5), 2010, section 3.

Keywords:
  poses: number of poses in the window
)";

template <class Window, class Piece, class Make>
void define_window(py::module_& m, const char* name, const char* doc, const Make& make) {
  const auto fields = smoother_fields();
  py::class_<Window> cls(m, name, doc);
  make(cls, fields);
  cls.def("add_odometry", &Window::add_odometry, py::arg("odometry"),
          "Adds odometry, in the order of time. Returns: False if it starts before the end of the "
          "previous odometry and is ignored.")
      .def("add_frame", &Window::add_frame, py::arg("frame"),
           "Adds a SmootherFrame. Returns: the newest pose and the window.")
      .def("add_observation", &Window::add_observation, py::arg("observation"),
           "Adds a PoseObservation, from an image or as a prior. Returns: the newest pose and the "
           "window.")
      .def("restart", &Window::restart,
           "Deletes all poses, for example after the clock was set back.");
  if constexpr (std::is_same_v<Window, PlanarWindowSmoother>)
    cls.def("add_prior", &Window::add_prior, py::arg("prior"),
            "Adds a PlanarPrior. Returns: the newest pose and the window.");
}

void define_windows(py::module_& m) {
  const std::string options_doc = fields_doc(smoother_fields(), "Options");
  const std::string doc = window_doc + options_doc.substr(options_doc.find(":\n") + 2);
  define_window<WindowSmoother, Odometry>(
      m, "WindowSmoother", doc.c_str(), [&](auto& cls, const auto& fields) {
        define_constructor(
            cls, fields,
            [](SmootherOptions options, int poses) {
              return WindowSmoother({poses, options});
            },
            py::arg("poses") = WindowOptions{}.poses, py::kw_only());
      });
  define_window<PlanarWindowSmoother, PlanarOdometry>(
      m, "PlanarWindowSmoother",
      (doc + "  height_m: height of the body's origin above the world's z = 0 [m]; it is upright\n")
          .c_str(),
      [&](auto& cls, const auto& fields) {
        define_constructor(
            cls, fields,
            [](SmootherOptions options, int poses, double height_m) {
              return PlanarWindowSmoother({poses, options}, height_m);
            },
            py::arg("poses") = WindowOptions{}.poses, py::arg("height_m") = 0.0, py::kw_only());
      });
}

}  // namespace

void define_smoother(py::module_& m) {
  define_smoother_frame(m);
  define_link(m);
  define_smoothings(m);
  define_smooth(m);
  define_estimates(m);
  define_windows(m);
}

}  // namespace occ::python
