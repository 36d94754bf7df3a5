// SPDX-License-Identifier: Apache-2.0
// Window of smooth/window_smoother.hpp for both kinds of poses.
//
// The window holds a branch for each plausible trajectory. While the prediction of a branch is
// narrow and fits the new frame, the branch is only adjusted; otherwise all minima of its window
// are searched, and each is a branch. The chi2 of the poses before the window is kept for each
// branch, so that branches remain comparable when the frames that differ have left the window.
#pragma once

#include <functional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_search.hpp"
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
  const SmootherOptions& options() const { return options_.smoothing; }
  ErrorNumbers& numbers() { return numbers_; }
  void restart();

 private:
  /// A trajectory that the data leave plausible. All branches have the same nodes and links, but
  /// their own priors from the poses before the window.
  struct Branch {
    ChainMinimum<Body> minimum;
    double forgotten_chi2 = 0;  ///< chi2 of the poses before the window
    double chi2() const { return forgotten_chi2 + minimum.chi2; }
  };

  static int contradictions(const Branch& branch);
  void insert_node(Branch& branch, std::size_t k, double time_s) const;
  void link(Chain<Body>& chain, std::size_t k) const;
  bool link_late(Chain<Body>& chain) const;
  void forget_oldest(Branch& branch) const;
  Pose expected(const Branch& branch, std::size_t k) const;
  bool is_settled(const Branch& branch, std::size_t k) const;
  void solve(Branch& branch) const;
  void search(const Branch& branch, std::size_t k, std::vector<Branch>& found) const;
  void update(Branch branch, std::size_t k, bool settled, std::vector<Branch>& found) const;
  void keep_plausible(std::vector<Branch> found);
  Estimate estimate() const;

  Body body_;
  WindowOptions options_;
  std::vector<Branch> branches_;  // best first; empty without poses
  OdometryPieces<Body> pieces_{true};
  ErrorNumbers numbers_;
};

}  // namespace occ::internal::smooth
