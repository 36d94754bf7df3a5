// SPDX-License-Identifier: Apache-2.0
// Methods of the literature that use the shape of a luminaire, for comparison. They were written
// from their papers. As all methods of the ladder, they know which lamp a blob is and which corner
// of a lamp a corner of its image is, where the papers use a code.
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "libocc/core/internal/least_squares.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/ladder/internal/ladder_steps.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "libocc/pose/solvers/p3p.hpp"

namespace occ::internal::ladder {

using namespace internal::pose;
namespace {

const Result<Rigid3> no_answer{{}, Status::no_pose, ""};

/// Rigid transform between points that are columns (Umeyama 1991).
Result<Rigid3> registered(const Eigen::Matrix3Xd& in_world, const Eigen::Matrix3Xd& in_cam) {
  const Eigen::Matrix4d transform = Eigen::umeyama(in_world, in_cam, false);
  if (!transform.allFinite()) return no_answer;
  return {{transform.topLeftCorner<3, 3>(), transform.topRightCorner<3, 1>()}, Status::ok, ""};
}

/// V-P4L (Bai et al., "Novel visible light communication assisted perspective-four-line
/// algorithm for indoor localization", arXiv:2009.12320): each side of a rectangle and the camera's
/// centre span a plane; the normals of two opposite planes give the direction of these sides, and
/// both directions give the rectangle's normal. Its size gives the distance. Assumptions: the
/// largest image is used, the scale is that of the sum of the sides, and the pose is the rigid
/// transform of the four corners.
Result<Rigid3> by_v_p4l(const LadderProblem& p) {
  Eigen::Index largest = 0;
  double max_area = 0;
  for (Eigen::Index i = 0; i < p.corners_px.cols(); i += 4) {
    const Eigen::Vector2d first = p.corners_px.col(i + 2) - p.corners_px.col(i);
    const Eigen::Vector2d second = p.corners_px.col(i + 3) - p.corners_px.col(i + 1);
    const double area = std::abs(first.x() * second.y() - first.y() * second.x());
    if (area > max_area) std::tie(max_area, largest) = std::make_tuple(area, i);
  }
  const Eigen::Matrix3Xd in_world = p.corners_in_world.middleCols(largest, 4);
  Eigen::Matrix3Xd rays(3, 4);
  for (int i = 0; i < 4; ++i) {
    const auto ray = p.scene.camera.unproject(p.corners_px.col(largest + i));
    if (!ray) return no_answer;
    rays.col(i) = *ray;
  }
  const auto plane = [&](int i) -> Eigen::Vector3d {
    return rays.col(i).cross(rays.col((i + 1) % 4));
  };
  const Eigen::Vector3d along = plane(0).cross(plane(2)), across = plane(1).cross(plane(3));
  const Eigen::Vector3d normal = along.cross(across).normalized();
  Eigen::Matrix3Xd in_cam(3, 4);
  for (int i = 0; i < 4; ++i) in_cam.col(i) = rays.col(i) / normal.dot(rays.col(i));
  if (normal.dot(rays.col(0)) < 0) in_cam = -in_cam;
  double true_m = 0, seen = 0;
  for (int i = 0; i < 4; ++i) {
    true_m += (in_world.col((i + 1) % 4) - in_world.col(i)).norm();
    seen += (in_cam.col((i + 1) % 4) - in_cam.col(i)).norm();
  }
  return registered(in_world, true_m / seen * in_cam);
}

/// A disc in the camera's frame.
struct SeenDisc {
  Eigen::Vector3d centre, normal;
};

/// Both discs of a radius whose rim is seen along these rays: the cone through the rim has two
/// circular sections (Chen, Wu, Wada, "Camera calibration with two arbitrary coplanar circles",
/// ECCV 2004).
std::vector<SeenDisc> discs_of(const Eigen::Matrix3Xd& rays, double radius_m) {
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  for (const auto& r : rays.colwise()) {
    Eigen::Matrix<double, 6, 1> terms;
    terms << r.x() * r.x(), 2 * r.x() * r.y(), r.y() * r.y(), 2 * r.x() * r.z(), 2 * r.y() * r.z(),
        r.z() * r.z();
    sum += terms * terms.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> fit(sum);
  const Eigen::Matrix<double, 6, 1> q = fit.eigenvectors().col(0);
  Eigen::Matrix3d cone;
  cone << q[0], q[1], q[3], q[1], q[2], q[4], q[3], q[4], q[5];
  if (cone.determinant() > 0) cone = -cone;  // one negative eigenvalue
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(cone);
  const double l3 = axes.eigenvalues()[0], l2 = axes.eigenvalues()[1], l1 = axes.eigenvalues()[2];
  if (!(l3 < 0 && l2 > 0)) return {};
  const double g = std::sqrt((l1 - l2) / (l1 - l3)), h = std::sqrt((l2 - l3) / (l1 - l3));
  const Eigen::Vector3d x = axes.eigenvectors().col(2), z = axes.eigenvectors().col(0);
  const double scale_m = radius_m / std::sqrt(-l1 * l3);
  std::vector<SeenDisc> discs;
  for (const double sign : {1.0, -1.0}) {
    SeenDisc disc{scale_m * (sign * l3 * g * x + l1 * h * z), sign * g * x + h * z};
    if (disc.centre.dot(rays.col(0)) < 0) disc.centre = -disc.centre;
    if (disc.centre.dot(disc.normal) > 0) disc.normal = -disc.normal;  // towards the camera
    discs.push_back(disc);
  }
  return discs;
}

/// PAA (Zhu, Guo, Bao, Chen, Saad, Yang, "Positioning using visible light communications: a
/// perspective arcs approach", arXiv:2204.08131): the arc of a circular luminaire gives its normal
/// and centre in the camera's frame but for a twofold ambiguity; other luminaires resolve it and
/// give the turn about the normal. Assumptions: all discs with a rim are used, arcs are fitted
/// algebraically, and the pose is the rigid transform of the centres and of the points a radius
/// along the normals.
Result<Rigid3> by_paa(const LadderProblem& p) {
  std::vector<const Lamp*> lamps;
  std::vector<std::vector<SeenDisc>> seen;
  for (const Match& match : p.matches) {
    const Lamp& lamp = p.scene.lamps[match.lamp];
    const Blob& blob = p.blobs[match.blob];
    if (lamp.shape != LampShape::disc || blob.free_form || blob.rim.size() < 6) continue;
    Eigen::Matrix3Xd rays(3, static_cast<Eigen::Index>(blob.rim.size()));
    for (std::size_t i = 0; i < blob.rim.size(); ++i) {
      const auto ray = p.scene.camera.unproject(blob.rim[i].px);
      if (!ray) return no_answer;
      rays.col(static_cast<Eigen::Index>(i)) = *ray;
    }
    std::vector<SeenDisc> both = discs_of(rays, lamp.radius_m);
    if (both.empty()) continue;
    lamps.push_back(&lamp);
    seen.push_back(std::move(both));
  }
  if (lamps.size() < 2) return no_answer;
  const auto count = static_cast<Eigen::Index>(lamps.size());
  Eigen::Matrix3Xd in_world(3, 2 * count), in_cam(3, 2 * count);
  Result<Rigid3> best = no_answer;
  double min_misfit = infinity;
  for (const SeenDisc& first : seen[0]) {
    for (std::size_t i = 0; i < lamps.size(); ++i) {
      const double angle = lamps[i]->normal.dot(lamps[0]->normal);
      const auto off = [&](const SeenDisc& d) {
        return std::abs(d.normal.dot(first.normal) - angle);
      };
      const SeenDisc& disc = off(seen[i][0]) < off(seen[i][1]) ? seen[i][0] : seen[i][1];
      const auto at = 2 * static_cast<Eigen::Index>(i);
      const double radius_m = lamps[i]->radius_m;
      in_world.col(at) = lamps[i]->centre_m;
      in_world.col(at + 1) = lamps[i]->centre_m + radius_m * lamps[i]->normal;
      in_cam.col(at) = disc.centre;
      in_cam.col(at + 1) = disc.centre + radius_m * disc.normal;
    }
    Result<Rigid3> pose = registered(in_world, in_cam);
    if (!pose.ok()) continue;
    const double misfit =
        (((pose->rotation * in_world).colwise() + pose->translation) - in_cam).squaredNorm();
    if (misfit < min_misfit) std::tie(min_misfit, best) = std::make_tuple(misfit, pose);
  }
  return best;
}

/// R-P3P (Bai, Yang, Feng, Guo, "A novel received signal strength assisted perspective-three-point
/// algorithm for indoor visible light positioning", arXiv:2005.11162): of the poses that three
/// lamps allow, the one whose distances and angles explain the received signals. Assumption: the
/// roots are found by p3p instead of Wu-Ritt's decomposition.
Result<Rigid3> by_r_p3p(const LadderProblem& p) {
  const Triple triple = spread_triple(p.points_in_world);
  Result<Rigid3> best = no_answer;
  double min_misfit = infinity;
  for (const Rigid3& pose : candidates_of_three(p, p3p_solver, triple)) {
    double misfit = 0;
    for (const int i : triple) {
      const Match& match = p.matches[static_cast<std::size_t>(i)];
      const double expected_dn =
          p.scene.sensor.gain_dn_per_e *
          lamp_electrons(p.scene.lamps[match.lamp], pose, p.scene.camera, p.scene.sensor);
      misfit +=
          expected_dn > 0 ? square(std::log(p.blobs[match.blob].flux_dn / expected_dn)) : infinity;
    }
    if (misfit < min_misfit)
      std::tie(min_misfit, best) = std::make_tuple(misfit, Result<Rigid3>{pose, Status::ok, ""});
  }
  return best;
}

/// Residuals of the rays through all rims: (|x|^n + |y|^n)^(1/n) - 1, where (x, y) is the place at
/// which a ray meets the lamp's plane, over its half sides.
class LameResiduals {
 public:
  static constexpr int unknowns = 6;

  LameResiduals(const LadderProblem& p, const Rigid3& start) : start_(start) {
    for (const Match& match : p.matches) {
      const Lamp& lamp = p.scene.lamps[match.lamp];
      if (lamp.shape == LampShape::point || lamp.shape == LampShape::polygon) continue;
      Outline outline{lamp, lamp.normal.unitOrthogonal(), {}, 2, {}};
      outline.half_m.setConstant(lamp.radius_m);
      if (lamp.shape != LampShape::disc) {
        outline.x_axis = lamp.x_axis;
        outline.half_m = 0.5 * lamp.size_m;
        outline.exponent = lamp.shape == LampShape::lame ? lamp.exponent : infinity;
      }
      for (const RimPoint& point : p.blobs[match.blob].rim) {
        const auto ray = p.scene.camera.unproject(point.px);
        if (ray) outline.rays.push_back(*ray);
      }
      outlines_.push_back(std::move(outline));
    }
  }

  Rigid3 pose(const Vector6& x) const { return perturb(start_, x); }

  double chi2(const Vector6& x) {
    core::NormalSums<6> sums;
    return this->sums(x, sums) ? sums.chi2 : infinity;
  }

  bool sums(const Vector6& at, core::NormalSums<6>& sums) {
    sums.set_zero(6);
    const Rigid3 pose = this->pose(at);
    for (const Outline& outline : outlines_) {
      const Eigen::Vector3d centre = pose * outline.lamp.centre_m;
      const Eigen::Vector3d normal = pose.rotation * outline.lamp.normal;
      const std::array<Eigen::Vector3d, 2> axes = {
          pose.rotation * outline.x_axis,
          pose.rotation * outline.lamp.normal.cross(outline.x_axis)};
      for (const Eigen::Vector3d& ray : outline.rays) {
        const double height = centre.dot(normal), cosine = ray.dot(normal);
        const double distance = height / cosine;
        if (!(distance > 0)) return false;
        const Eigen::Vector3d from_centre = distance * ray - centre;
        Vector6
            d_distance;  // by turn and shift: d normal = turn x normal, d height = shift . normal
        d_distance << -height / square(cosine) * normal.cross(ray), normal / cosine;
        Eigen::Vector2d place;
        Eigen::Matrix<double, 2, 6> d_place;
        for (int k = 0; k < 2; ++k) {
          const Eigen::Vector3d& axis = axes[static_cast<std::size_t>(k)];
          place[k] = from_centre.dot(axis) / outline.half_m[k];
          d_place.row(k) << (axis.cross(from_centre) - centre.cross(axis)).transpose(),
              -axis.transpose();
          d_place.row(k) += ray.dot(axis) * d_distance.transpose();
          d_place.row(k) /= outline.half_m[k];
        }
        const auto [size, by_place] = size_of(place, outline.exponent);
        const Vector6 row = (by_place.transpose() * d_place).transpose();
        sums.information += row * row.transpose();
        sums.gradient += (size - 1) * row;
        sums.chi2 += square(size - 1);
      }
    }
    return true;
  }

 private:
  struct Outline {
    Lamp lamp;
    Eigen::Vector3d x_axis;
    Eigen::Vector2d half_m;
    double exponent;
    std::vector<Eigen::Vector3d> rays;
  };

  /// The norm of the exponent and its derivative.
  static std::pair<double, Eigen::Vector2d> size_of(const Eigen::Vector2d& place, double exponent) {
    const Eigen::Vector2d magnitude = place.cwiseAbs();
    if (std::isinf(exponent)) {
      const int k = magnitude[0] > magnitude[1] ? 0 : 1;
      return {magnitude[k], std::copysign(1, place[k]) * Eigen::Vector2d::Unit(k)};
    }
    const double size =
        std::pow(std::pow(magnitude[0], exponent) + std::pow(magnitude[1], exponent), 1 / exponent);
    Eigen::Vector2d by_place;
    for (int k = 0; k < 2; ++k)
      by_place[k] = std::copysign(std::pow(magnitude[k] / size, exponent - 1), place[k]);
    return {size, by_place};
  }

  Rigid3 start_;
  std::vector<Outline> outlines_;
};

/// LC-VLP (Pan, Yang, Wei, Zhu, Wang, Wu, Yao, "Visible light positioning with Lame curve LEDs: a
/// generic approach for camera pose estimation", arXiv:2602.01577): least squares over the outlines
/// as Lame curves. Assumptions: the residual is the n-th root of the curve's left side minus 1, a
/// rectangle is the limit of large n, all points have the same weight, and the start is that of the
/// other rungs instead of FreePnP.
Result<Rigid3> by_lc_vlp(const LadderProblem& p) {
  const Result<Rigid3> start = start_of(p);
  if (!start.ok()) return start;
  LameResiduals residuals(p, *start);
  Vector6 x = Vector6::Zero();
  core::LeastSquaresOptions options;
  options.chi2_tolerance = 1e-15;
  core::minimise_sums(residuals, x, options);
  return {residuals.pose(x), Status::ok, ""};
}

bool discs_with_rims(const LadderProblem& p) {
  int count = 0;
  for (const Match& match : p.matches)
    count += p.scene.lamps[match.lamp].shape == LampShape::disc && !p.blobs[match.blob].rim.empty();
  return count >= 2;
}

bool any_rim(const LadderProblem& p) {
  for (const Match& match : p.matches)
    if (!p.blobs[match.blob].rim.empty()) return has_start(p);
  return false;
}

bool three_with_flux(const LadderProblem& p) {
  for (const Match& match : p.matches)
    if (p.blobs[match.blob].saturated) return false;
  return p.matches.size() >= 3;
}

}  // namespace

std::vector<LadderStep> shape_steps() {
  constexpr FluxModel no_flux = FluxModel::ignore;
  return {{"v_p4l", "literature", "lines of the largest rectangle", Rung::rims, no_flux,
           has_rectangle, by_v_p4l},
          {"paa", "literature", "circular arcs", Rung::rims, no_flux, discs_with_rims, by_paa},
          {"r_p3p", "literature", "three points, chosen by their brightness", Rung::points,
           FluxModel::known_power, three_with_flux, by_r_p3p},
          {"lc_vlp", "literature", "least squares over Lame curves", Rung::rims, no_flux, any_rim,
           by_lc_vlp}};
}

}  // namespace occ::internal::ladder
