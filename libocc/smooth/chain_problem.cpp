// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::smooth {
namespace {

template <int size>
using Rows = Eigen::Matrix<double, Eigen::Dynamic, size, 0, size, size>;

constexpr double infinite = std::numeric_limits<double>::infinity();

}  // namespace

template <class Pose, int size>
Quadratic<Pose, size> quadratic(const Pose& about,
                                const Eigen::Matrix<double, size, size>& information,
                                const Eigen::Matrix<double, size, 1>& gradient) {
  using Square = Eigen::Matrix<double, size, size>;
  using Vector = Eigen::Matrix<double, size, 1>;
  // Scaled to a unit diagonal: the rank does not depend on the units.
  Vector unit = information.diagonal();
  for (int i = 0; i < size; ++i) unit[i] = unit[i] > 0 ? 1 / std::sqrt(unit[i]) : 0;
  const Square scaled = unit.asDiagonal() * (0.5 * (information + information.transpose())).eval() *
                        unit.asDiagonal();
  const auto eigen = core::symmetric_eigen<Square>(scaled);
  Quadratic<Pose, size> out{about, {}, Vector::Zero()};
  int first = size;
  while (first > 0 && eigen.eigenvalues()[first - 1] > 1e-13) --first;
  const int rows = size - first;
  out.root.resize(rows, size);
  Vector unscale = Vector::Zero();
  for (int i = 0; i < size; ++i) unscale[i] = unit[i] > 0 ? 1 / unit[i] : 0;
  for (int row = 0; row < rows; ++row) {
    const double value = eigen.eigenvalues()[first + row];
    const Vector axis = eigen.eigenvectors().col(first + row);
    out.root.row(row) = std::sqrt(value) * axis.transpose() * unscale.asDiagonal();
    const Vector along = unit.cwiseProduct(axis);
    out.offset -= along * (along.dot(gradient) / value);
  }
  return out;
}

View::View(const SmootherFrame& seen)
    : frame(seen), aside(seen.sightings.size(), false), d_body(adjoint(seen.cam_from_body)) {
  for (const PointSighting& sighting : seen.sightings)
    root.push_back(core::Cholesky<Eigen::Matrix2d>(sighting.covariance_px2)
                       .solve_lower<Eigen::Matrix2d>(Eigen::Matrix2d::Identity()));
}

std::optional<Eigen::Vector2d> sighting_residual(const View& view, std::size_t i,
                                                 const Rigid3& body_from_world,
                                                 Eigen::Matrix<double, 2, 6>* d_body) {
  const PointSighting& sighting = view.frame.sightings[i];
  const Eigen::Vector3d in_cam =
      view.frame.cam_from_body * (body_from_world * sighting.point_in_world);
  Eigen::Matrix<double, 2, 3> d_point;
  const auto px = view.frame.camera.project(in_cam, d_body != nullptr ? &d_point : nullptr);
  if (!px || !px->allFinite()) return std::nullopt;
  if (d_body != nullptr) {
    Eigen::Matrix<double, 2, 6> d_cam;
    d_cam << -d_point * skew(in_cam), d_point;
    *d_body = view.root[i] * d_cam * view.d_body;
  }
  return Eigen::Vector2d(view.root[i] * view.frame.camera.difference_px(*px, sighting.px));
}

template <class Body>
double Chain<Body>::node_cost(std::size_t k, const Pose& pose, typename Body::Block* information,
                              typename Body::Part* gradient) const {
  const Node<Body>& node = nodes[k];
  const Rigid3 spatial = body.body_from_world(pose);
  Matrix6 information6 = Matrix6::Zero();
  Vector6 gradient6 = Vector6::Zero();
  double cost = 0;
  Eigen::Matrix<double, 2, 6> d_body;
  for (const View& view : node.views) {
    for (std::size_t i = 0; i < view.root.size(); ++i) {
      if (view.aside[i]) continue;
      const auto residual =
          sighting_residual(view, i, spatial, information != nullptr ? &d_body : nullptr);
      if (!residual) return infinite;
      const double squared = residual->squaredNorm();
      cost += core::huber_loss(squared, sighting_corner);
      if (information == nullptr) continue;
      const double weight = core::huber_weight(squared, sighting_corner);
      information6.noalias() += weight * d_body.transpose() * d_body;
      gradient6.noalias() += weight * d_body.transpose() * *residual;
    }
  }
  for (const auto& reading : node.readings) {
    Matrix6 d_pose;
    const Vector6 delta = SpatialBody::difference(spatial, reading.about, &d_pose);
    const Eigen::VectorXd residual = reading.root * (delta - reading.offset);
    cost += 0.5 * residual.squaredNorm();
    if (information == nullptr) continue;
    const Rows<6> jacobian = reading.root * d_pose;
    information6.noalias() += jacobian.transpose() * jacobian;
    gradient6.noalias() += jacobian.transpose() * residual;
  }
  if (information != nullptr) {
    const typename Body::Lift lift = body.lift(pose);
    *information += lift.transpose() * information6 * lift;
    *gradient += lift.transpose() * gradient6;
  }
  for (const auto& prior : node.priors) {
    typename Body::Block d_pose;
    const typename Body::Part delta = Body::difference(pose, prior.about, &d_pose);
    const Eigen::VectorXd residual = prior.root * (delta - prior.offset);
    cost += 0.5 * residual.squaredNorm();
    if (information == nullptr) continue;
    const Rows<Body::size> jacobian = prior.root * d_pose;
    *information += jacobian.transpose() * jacobian;
    *gradient += jacobian.transpose() * residual;
  }
  return std::isfinite(cost) ? cost : infinite;
}

template <class Body>
double Chain<Body>::link_cost(std::size_t k, const std::vector<Pose>& poses) const {
  const Link<Body>& link = links[k];
  if (!link.exists) return 0;
  const typename Body::Part residual =
      link.root * Body::residual(poses[k], poses[k + 1], link.step, nullptr, nullptr);
  return core::huber_loss(residual.squaredNorm() / link.report.factor, corner_of(link));
}

template <class Body>
LinkTerms<Body> Chain<Body>::link_terms(std::size_t k, const std::vector<Pose>& poses) const {
  const Link<Body>& link = links[k];
  LinkTerms<Body> out;
  out.residual = Body::residual(poses[k], poses[k + 1], link.step, &out.d_from, &out.d_to);
  out.residual = (link.root * out.residual).eval();
  out.d_from = (link.root * out.d_from).eval();
  out.d_to = (link.root * out.d_to).eval();
  out.weight =
      core::huber_weight(out.residual.squaredNorm() / link.report.factor, corner_of(link)) /
      link.report.factor;
  return out;
}

template <class Body>
void Chain<Body>::add_link(std::size_t k, const std::vector<Pose>& poses,
                           ChainNormals<Body::size>& into) const {
  const LinkTerms<Body> t = link_terms(k, poses);
  into.from[k].noalias() += t.weight * t.d_from.transpose() * t.d_from;
  into.to[k].noalias() += t.weight * t.d_to.transpose() * t.d_to;
  into.coupling[k].noalias() += t.weight * t.d_from.transpose() * t.d_to;
  into.gradient[k].noalias() += t.weight * t.d_from.transpose() * t.residual;
  into.gradient[k + 1].noalias() += t.weight * t.d_to.transpose() * t.residual;
}

template <class Body>
double Chain<Body>::cost(const std::vector<Pose>& poses) const {
  double sum = 0;
  for (std::size_t k = 0; k < nodes.size() && sum < infinite; ++k) {
    sum += node_cost(k, poses[k], nullptr, nullptr);
    if (k + 1 < nodes.size()) sum += link_cost(k, poses);
  }
  return std::isfinite(sum) ? sum : infinite;
}

template <class Body>
ChainNormals<Body::size> Chain<Body>::normals(const std::vector<Pose>& poses) const {
  ChainNormals<Body::size> out(nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    node_cost(k, poses[k], &out.own[k], &out.gradient[k]);
    if (k + 1 < nodes.size() && links[k].exists) add_link(k, poses, out);
  }
  return out;
}

template <class Body>
bool Chain<Body>::set_aside(const std::vector<Pose>& poses) {
  bool changed = false;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Rigid3 spatial = body.body_from_world(poses[k]);
    for (View& view : nodes[k].views) {
      for (std::size_t i = 0; i < view.root.size(); ++i) {
        const bool aside = !sighting_residual(view, i, spatial);
        changed = changed || aside != view.aside[i];
        view.aside[i] = aside;
      }
    }
  }
  return changed;
}

template <class Body>
std::vector<bool> Chain<Body>::linked() const {
  std::vector<bool> out;
  for (const auto& link : links) out.push_back(link.exists);
  return out;
}

template <class Body>
int Chain<Body>::rows() const {
  Eigen::Index rows = 0;
  for (const auto& node : nodes) {
    for (const View& view : node.views)
      rows += 2 * std::count(view.aside.begin(), view.aside.end(), false);
    for (const auto& reading : node.readings) rows += reading.root.rows();
    for (const auto& prior : node.priors) rows += prior.root.rows();
  }
  for (const auto& link : links) rows += link.exists ? Body::size : 0;
  return static_cast<int>(rows);
}

template <class Body>
Link<Body> made_link(const typename Body::Step& step, double from_s, double to_s, bool odometry,
                     const SmootherOptions& options) {
  using Block = typename Body::Block;
  Link<Body> link;
  link.exists = true;
  link.step = step;
  link.report.from_s = from_s;
  link.report.to_s = to_s;
  link.report.odometry = odometry;
  Block covariance = step.covariance;
  covariance.diagonal() +=
      Body::sigmas(options.min_odometry_sigma_m, options.min_odometry_sigma_rad).cwiseAbs2();
  const core::Cholesky<Block> cholesky(0.5 * (covariance + covariance.transpose()));
  require(cholesky.exists(), "odometry's covariance", step.covariance,
          "positive definite together with min_odometry_sigma_m, min_odometry_sigma_rad");
  link.root = cholesky.template solve_lower<Block>(Block::Identity());
  return link;
}

template <class Body>
Link<Body> walk_link(double from_s, double to_s, const SmootherOptions& options) {
  if (!std::isfinite(options.walk_m) || !std::isfinite(options.walk_rad)) {
    Link<Body> none;
    none.report.from_s = from_s;
    none.report.to_s = to_s;
    return none;
  }
  typename Body::Step stays;
  stays.covariance.diagonal() =
      Body::sigmas(options.walk_m, options.walk_rad).cwiseAbs2() * (to_s - from_s);
  return made_link<Body>(stays, from_s, to_s, false, options);
}

template struct Chain<SpatialBody>;
template struct Chain<PlanarBody>;
template Quadratic<Rigid3, 6> quadratic(const Rigid3&, const Matrix6&, const Vector6&);
template Quadratic<PlanarPose, 3> quadratic(const PlanarPose&, const Eigen::Matrix3d&,
                                            const Eigen::Vector3d&);
template Link<SpatialBody> made_link<SpatialBody>(const SpatialBody::Step&, double, double, bool,
                                                  const SmootherOptions&);
template Link<PlanarBody> made_link<PlanarBody>(const PlanarBody::Step&, double, double, bool,
                                                const SmootherOptions&);
template Link<SpatialBody> walk_link<SpatialBody>(double, double, const SmootherOptions&);
template Link<PlanarBody> walk_link<PlanarBody>(double, double, const SmootherOptions&);

}  // namespace occ::internal::smooth
