// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/locate/robust_pose.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/candidates.hpp"
#include "libocc/pose/internal/missing_method.hpp"

namespace occ::internal::smooth {
namespace {

struct Seen {
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd px;
  std::vector<double> sigmas_px;
};

/// Estimate of the distance of the points from the camera. Two points are at least as far apart as
/// the chord between their bearings times the distance of the nearer one.
double distance_of_m(const Camera& camera, const std::vector<PointSighting>& sightings) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const PointSighting& a : sightings) {
    const auto from = camera.unproject(a.px);
    for (const PointSighting& b : sightings) {
      const auto to = camera.unproject(b.px);
      if (!from || !to || *from == *to) continue;
      nearest =
          std::min(nearest, (a.point_in_world - b.point_in_world).norm() / (*from - *to).norm());
    }
  }
  return nearest;
}

/// Variance of a pixel coordinate due to the errors of a point at some distance.
double variance_by_point(const Camera& camera, const PointSighting& seen, double distance_m) {
  Eigen::Matrix<double, 2, 3> d_point;
  if (!camera.project(distance_m * *camera.unproject(seen.px), &d_point)) return 0;
  return d_point.squaredNorm() / 2 * seen.point_covariance_m2.trace() / 3;
}

/// Correspondences for a solver: pixels inside the camera's domain, each point once.
Seen solvable(const View& view) {
  Seen out;
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < view.frame.sightings.size(); ++i)
    if (view.frame.camera.unproject(view.frame.sightings[i].px)) used.push_back(i);
  const bool exact = view.errors.point_roots.empty();
  const double distance_m = exact ? 0 : distance_of_m(view.frame.camera, view.frame.sightings);
  const auto count = static_cast<Eigen::Index>(used.size());
  out.points.resize(3, count);
  out.px.resize(2, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const PointSighting& s = view.frame.sightings[used[i]];
    out.points.col(i) = s.point_in_world;
    out.px.col(i) = s.px;
    double variance = 0.5 * s.covariance_px2.trace();
    if (!exact && distance_m > 0 && std::isfinite(distance_m))
      variance += variance_by_point(view.frame.camera, s, distance_m);
    out.sigmas_px.push_back(std::sqrt(variance));
  }
  return out;
}

std::vector<Rigid3> poses_of(const View& view) {
  const Seen seen = solvable(view);
  std::vector<Rigid3> out;
  if (seen.points.cols() < 3) return out;
  SolvePoseOptions options;
  options.sigmas_px = seen.sigmas_px;
  const Result<Fix> fix = solve_pose(seen.points, seen.px, view.frame.camera, options);
  for (const Candidate& candidate : fix->candidates) out.push_back(candidate.cam_from_world);
  if (!fix.ok() && fix.status != Status::ambiguous && seen.points.cols() >= 5) {
    RobustPoseOptions robust;  // tolerates outliers
    robust.sigma_px = *std::max_element(seen.sigmas_px.begin(), seen.sigmas_px.end());
    const Result<RobustPose> found = robust_pose(seen.points, seen.px, view.frame.camera, robust);
    if (found.ok()) return {found->fix.cam_from_world};
  }
  return out;
}

/// Pose of an upright body from the two sightings that are farthest apart in the image.
std::vector<Rigid3> upright_poses_of(const View& view) {
  const Seen seen = solvable(view);
  std::vector<Rigid3> out;
  Eigen::Index first = 0, second = 0;
  double furthest = 0;
  for (Eigen::Index i = 0; i < seen.px.cols(); ++i) {
    for (Eigen::Index j = i + 1; j < seen.px.cols(); ++j) {
      const double apart = (seen.px.col(i) - seen.px.col(j)).norm();
      if (apart <= furthest) continue;
      furthest = apart;
      first = i;
      second = j;
    }
  }
  if (furthest == 0 || !view.frame.camera.is_central()) return out;
  PoseProblem problem;
  problem.bearings.resize(3, 2);
  problem.points.resize(3, 2);
  problem.bearings << *view.frame.camera.unproject(seen.px.col(first)),
      *view.frame.camera.unproject(seen.px.col(second));
  problem.points << seen.points.col(first), seen.points.col(second);
  problem.up_in_cam = view.frame.cam_from_body.rotation.col(2);
  CandidateOptions anything;
  anything.tolerance_rad = 3;
  for (const PoseCandidate& candidate : pose_candidates(problem, "upright_p2p", anything).value)
    out.push_back(candidate.cam_from_world);
  return out;
}

template <class Body>
double misfit(const Chain<Body>& chain, std::size_t k, const typename Body::Pose& pose) {
  constexpr double outside = 1e12;  // larger than any residual inside the image
  const Rigid3 spatial = chain.body.body_from_world(pose);
  double sum = 0;
  for (const View& view : chain.nodes[k].views) {
    for (const auto& residual : residuals_of(view, spatial, chain.sighting_corner)) {
      sum += residual ? residual->norm() : outside;  // not squared: robust against an outlier
    }
  }
  return sum;
}

template <class Body>
std::size_t sightings_of(const Node<Body>& node) {
  std::size_t count = 0;
  for (const View& view : node.views) count += view.root.size();
  return count;
}

struct Ray {
  Eigen::Vector3d point, origin, bearing;  ///< origin and bearing in the frame of one node
};

/// Adds the rays of a node's points that are not among the rays yet.
template <class Body>
void add_rays(const Node<Body>& node, const Rigid3& at_from_body, std::vector<Ray>& rays) {
  for (const View& view : node.views) {
    if (!view.frame.camera.is_central()) continue;
    const Rigid3 at_from_cam = at_from_body * view.frame.cam_from_body.inverse();
    for (const PointSighting& seen : view.frame.sightings) {
      const auto bearing = view.frame.camera.unproject(seen.px);
      const bool known = std::any_of(rays.begin(), rays.end(), [&](const Ray& ray) {
        return ray.point == seen.point_in_world;
      });
      if (bearing && !known)
        rays.push_back(
            {seen.point_in_world, at_from_cam.translation, at_from_cam.rotation * *bearing});
    }
  }
}

/// Rays of a chain in the frame of node `at`, those of the nearest nodes first.
template <class Body>
std::vector<Ray> rays_of(const Chain<Body>& chain, std::size_t at) {
  std::vector<typename Body::Pose> poses(chain.nodes.size());
  for (std::size_t k = at; k + 1 < poses.size(); ++k)
    poses[k + 1] = Body::after(poses[k], chain.links[k].step);
  for (std::size_t k = at; k > 0; --k)
    poses[k - 1] = Body::before(poses[k], chain.links[k - 1].step);
  std::vector<Ray> rays;
  const Rigid3 from_start = chain.body.body_from_world(poses[at]);
  for (std::size_t away = 0; away < poses.size(); ++away) {
    for (const std::size_t k : {at - away, at + away}) {
      if (k >= poses.size() || (away == 0 && !rays.empty())) continue;
      add_rays(chain.nodes[k], from_start * chain.body.body_from_world(poses[k]).inverse(), rays);
    }
  }
  return rays;
}

/// The three rays whose points have the largest area.
std::vector<Ray> spread(const std::vector<Ray>& rays) {
  constexpr std::size_t enough = 12;
  const std::size_t n = std::min(rays.size(), enough);
  std::vector<Ray> out;
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j)
      for (std::size_t k = j + 1; k < n; ++k) {
        const double area =
            (rays[j].point - rays[i].point).cross(rays[k].point - rays[i].point).norm();
        if (area <= largest) continue;
        largest = area;
        out = {rays[i], rays[j], rays[k]};
      }
  return out;
}

std::vector<Rigid3> candidates_of(const SpatialBody&, const View& view) { return poses_of(view); }

std::vector<Rigid3> candidates_of(const PlanarBody&, const View& view) {
  std::vector<Rigid3> out = poses_of(view);
  for (const Rigid3& pose : upright_poses_of(view)) out.push_back(pose);
  return out;
}

}  // namespace

template <class Body>
bool fits(const Chain<Body>& chain, std::size_t k, const typename Body::Pose& pose, double sigmas) {
  return misfit(chain, k, pose) <= sigmas * static_cast<double>(sightings_of(chain.nodes[k]));
}

template <class Body>
std::vector<typename Body::Pose> poses_alone(const Body& body, const Node<Body>& node) {
  using Pose = typename Body::Pose;
  std::vector<Pose> found;
  for (const View& view : node.views) {
    for (const Rigid3& cam_from_world : candidates_of(body, view)) {
      const Pose pose = body.pose_of(view.frame.cam_from_body.inverse() * cam_from_world);
      if (Body::finite(pose)) found.push_back(pose);
    }
  }
  for (const auto& reading : node.readings)
    if (reading.root.rows() >= 6) found.push_back(body.pose_of(reading.about));
  for (const auto& prior : node.priors)
    if (prior.root.rows() >= Body::size) found.push_back(prior.about);
  return found;
}

template <class Body>
std::vector<typename Body::Pose> poses_together(const Chain<Body>& chain, std::size_t at) {
  using Pose = typename Body::Pose;
  const std::vector<Ray> three = spread(rays_of(chain, at));
  if (three.empty()) return {};
  const bool general = pose::is_in_build("gp3p");  // otherwise approximate: one common centre
  PoseProblem problem;
  problem.bearings.resize(3, 3);
  problem.points.resize(3, 3);
  if (general) problem.origins.resize(3, 3);
  for (int i = 0; i < 3; ++i) {
    problem.bearings.col(i) = three[i].bearing;
    problem.points.col(i) = three[i].point;
    if (general) problem.origins.col(i) = three[i].origin;
  }
  CandidateOptions anything;
  anything.tolerance_rad = 3;
  std::vector<Pose> out;
  for (const PoseCandidate& candidate :
       pose_candidates(problem, general ? "gp3p" : "p3p", anything).value) {
    const Pose pose = chain.body.pose_of(candidate.cam_from_world);
    if (Body::finite(pose)) out.push_back(pose);
  }
  return out;
}

template std::vector<Rigid3> poses_together(const Chain<SpatialBody>&, std::size_t);
template std::vector<PlanarPose> poses_together(const Chain<PlanarBody>&, std::size_t);
template std::vector<Rigid3> poses_alone(const SpatialBody&, const Node<SpatialBody>&);
template std::vector<PlanarPose> poses_alone(const PlanarBody&, const Node<PlanarBody>&);
template bool fits(const Chain<SpatialBody>&, std::size_t, const Rigid3&, double);
template bool fits(const Chain<PlanarBody>&, std::size_t, const PlanarPose&, double);

}  // namespace occ::internal::smooth
