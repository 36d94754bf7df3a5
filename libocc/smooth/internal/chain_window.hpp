// SPDX-License-Identifier: Apache-2.0
// Window of smooth/window_smoother.hpp for both kinds of poses.
#pragma once

#include <functional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_problem.hpp"
#include "libocc/smooth/internal/odometry_pieces.hpp"
#include "libocc/smooth/window_smoother.hpp"

namespace occ::internal::smooth {

template <class Body>
class ChainWindow {
 public:
  using Pose = typename Body::Pose;
  using Smoothed = typename Body::Smoothed;
  using Estimate = Result<WindowEstimate<Smoothed>>;

  ChainWindow(const Body& body, const WindowOptions& options);

  bool add_odometry(const typename Body::Piece& piece);
  /// Adds observations to the node of this time, which is created if needed, and solves.
  Estimate add(double time_s, const std::function<void(Node<Body>&)>& put);
  void restart();

 private:
  void insert_node(std::size_t k, double time_s);
  void link(std::size_t k);
  void forget_oldest();
  Pose start_of(std::size_t k) const;
  Estimate solve();

  WindowOptions options_;
  Chain<Body> chain_;
  std::vector<Pose> poses_;
  OdometryPieces<Body> pieces_{true};
};

}  // namespace occ::internal::smooth
