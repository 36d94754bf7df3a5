// SPDX-License-Identifier: Apache-2.0
// Chain of poses with all their observations: cost (half of chi2) and normal equations. Common to
// the batch smoother and the window smoother.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_body.hpp"
#include "libocc/smooth/internal/chain_normals.hpp"
#include "libocc/smooth/internal/view.hpp"
#include "libocc/smooth/smoother.hpp"

namespace occ::internal::smooth {

/// Quadratic term with minimum 0: residual = root (delta - offset), delta = difference(pose,
/// about).
template <class Pose, int size>
struct Quadratic {
  Pose about;
  Eigen::Matrix<double, Eigen::Dynamic, size, 0, size, size> root;
  Eigen::Matrix<double, size, 1> offset;
  CommonErrors<size> errors = {};
};

/// The term gradient . delta + 1/2 delta . information delta, without its constant. Directions
/// without information are left out.
template <class Pose, int size>
Quadratic<Pose, size> quadratic(const Pose& about,
                                const Eigen::Matrix<double, size, size>& information,
                                const Eigen::Matrix<double, size, 1>& gradient);

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
  OdometryLink report;                              ///< includes the inflation factor
  bool cleared = false;  ///< rejected first, then accepted again after a neighbour was rejected
};

/// Linearised residual of a link. Its weight is Huber's weight divided by the inflation factor.
template <class Body>
struct LinkTerms {
  typename Body::Part residual;  ///< in the given sigmas
  typename Body::Block d_from, d_to;
  double weight = 1;
};

template <class Body>
struct Chain {
  using Pose = typename Body::Pose;
  Body body;
  std::vector<Node<Body>> nodes;
  std::vector<Link<Body>> links;  ///< one fewer than nodes
  /// Corners of Huber's loss, in sigmas: of point sightings and of odometry.
  double sighting_corner = std::numeric_limits<double>::infinity();
  double odometry_corner = std::numeric_limits<double>::infinity();

  /// Half of the robust chi2; infinite if a sighting that is not aside is outside the domain.
  double cost(const std::vector<Pose>& poses) const;
  ChainNormals<Body::size> normals(const std::vector<Pose>& poses) const;
  /// Cost of one node or link; adds to `information` and `gradient` unless they are null.
  double node_cost(std::size_t k, const Pose& pose, typename Body::Block* information,
                   typename Body::Part* gradient) const;
  double link_cost(std::size_t k, const std::vector<Pose>& poses) const;
  LinkTerms<Body> link_terms(std::size_t k, const std::vector<Pose>& poses) const;
  void add_link(std::size_t k, const std::vector<Pose>& poses,
                ChainNormals<Body::size>& into) const;
  /// Marks the sightings outside the domain at these poses as aside; returns true if any mark
  /// changed.
  bool set_aside(const std::vector<Pose>& poses);
  /// Common errors in the gradient by pose k.
  CommonErrors<Body::size> errors_at(std::size_t k, const Pose& pose) const;
  bool has_errors() const;
  /// Sets the velocities of all views from odometry; zero where there is none.
  void set_velocities();
  std::vector<bool> linked() const;
  int rows() const;  ///< number of residuals, without those aside

 private:
  /// Links of the motion model have no robust loss.
  double corner_of(const Link<Body>& link) const {
    return link.report.odometry ? odometry_corner : std::numeric_limits<double>::infinity();
  }
};

/// An observation of a camera's pose as a term of the body's.
Quadratic<Rigid3, 6> reading_of(const PoseObservation& seen, ErrorNumbers& numbers);

template <class Body>
Link<Body> made_link(const typename Body::Step& step, double from_s, double to_s, bool odometry,
                     const SmootherOptions& options);

/// Random-walk link; it does not exist if its sigmas are infinite.
template <class Body>
Link<Body> walk_link(double from_s, double to_s, const SmootherOptions& options);

}  // namespace occ::internal::smooth
