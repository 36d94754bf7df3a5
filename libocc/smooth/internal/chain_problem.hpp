// SPDX-License-Identifier: Apache-2.0
// Internal: poses in a row with all that is known of them; its cost (half of chi2) and its normal
// equations. Batch and window smoothers build one each and share everything below.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_body.hpp"
#include "libocc/smooth/internal/chain_normals.hpp"
#include "libocc/smooth/smoother.hpp"

namespace occ::internal::smooth {

/// residual = root (delta - offset), delta = difference(pose, about): a quadratic whose constant is
/// chosen so that its smallest value is zero.
template <class Pose, int size>
struct Quadratic {
  Pose about;
  Eigen::Matrix<double, Eigen::Dynamic, size, 0, size, size> root;
  Eigen::Matrix<double, size, 1> offset;
};

/// Of gradient . delta + 1/2 delta . information delta; directions without information are left
/// out.
template <class Pose, int size>
Quadratic<Pose, size> quadratic(const Pose& about,
                                const Eigen::Matrix<double, size, size>& information,
                                const Eigen::Matrix<double, size, 1>& gradient);

/// Sightings of one camera at one pose.
struct View {
  SmootherFrame frame;
  std::vector<Eigen::Matrix2d> root;  ///< L^-1 of each sighting's covariance L L^T
  std::vector<bool> aside;            ///< outside the camera's domain at the poses found so far
  Matrix6 d_body;                     ///< adjoint(cam_from_body)

  explicit View(const SmootherFrame& seen);
};

template <class Body>
struct Node {
  double time_s = 0;
  std::vector<View> views;
  std::vector<Quadratic<Rigid3, 6>> readings;
  std::vector<Quadratic<typename Body::Pose, Body::size>> priors;
};

template <class Body>
struct Link {
  bool exists = false;
  typename Body::Step step;
  typename Body::Block root = Body::Block::Zero();  ///< L^-1 of the step's covariance L L^T
  OdometryLink report;                              ///< with its factor
  bool cleared = false;  ///< was contradicted, by a neighbour's lie as it turned out
};

/// What a link's residual is worth at a pose: Huber's weight over its factor.
template <class Body>
struct LinkTerms {
  typename Body::Part residual;  ///< in sigmas as they were given
  typename Body::Block d_from, d_to;
  double weight = 1;
};

template <class Body>
struct Chain {
  using Pose = typename Body::Pose;
  Body body;
  std::vector<Node<Body>> nodes;
  std::vector<Link<Body>> links;  ///< one less than nodes
  /// Corners of Huber's loss, in sigmas: of point sightings and of odometry.
  double sighting_corner = std::numeric_limits<double>::infinity();
  double odometry_corner = std::numeric_limits<double>::infinity();

  /// Infinite when a sighting that is not aside is outside its camera's domain.
  double cost(const std::vector<Pose>& poses) const;
  ChainNormals<Body::size> normals(const std::vector<Pose>& poses) const;
  /// Terms of one node alone, or of one link; `information` and `gradient` are added to when given.
  double node_cost(std::size_t k, const Pose& pose, typename Body::Block* information,
                   typename Body::Part* gradient) const;
  double link_cost(std::size_t k, const std::vector<Pose>& poses) const;
  LinkTerms<Body> link_terms(std::size_t k, const std::vector<Pose>& poses) const;
  void add_link(std::size_t k, const std::vector<Pose>& poses,
                ChainNormals<Body::size>& into) const;
  /// Sets aside what cannot be seen from these poses, and takes back what can; true when any
  /// changed.
  bool set_aside(const std::vector<Pose>& poses);
  std::vector<bool> linked() const;
  int rows() const;  ///< residuals, those aside apart

 private:
  /// Links of the motion model have no robust loss.
  double corner_of(const Link<Body>& link) const {
    return link.report.odometry ? odometry_corner : std::numeric_limits<double>::infinity();
  }
};

/// Residual of a sighting in its sigmas; nothing outside the camera's domain.
std::optional<Eigen::Vector2d> sighting_residual(const View& view, std::size_t i,
                                                 const Rigid3& body_from_world,
                                                 Eigen::Matrix<double, 2, 6>* d_body = nullptr);

template <class Body>
Link<Body> made_link(const typename Body::Step& step, double from_s, double to_s, bool odometry,
                     const SmootherOptions& options);

/// No link where that is infinite.
template <class Body>
Link<Body> walk_link(double from_s, double to_s, const SmootherOptions& options);

}  // namespace occ::internal::smooth
