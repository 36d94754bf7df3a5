// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/consensus.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libocc/core/random.hpp"
#include "libocc/pose/internal/consensus_cost.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/pose/solvers/upright_p2p.hpp"

namespace occ::internal::pose {
namespace {

// Samples almost as good as the best one are improved as well, one in so many iterations: the best
// one may be between two poses.
constexpr float near_cost = 2;
constexpr int iterations_per_near = 1024;

// Misfit of a pose to its own sample; the other points rank the poses.
constexpr double sample_tolerance_rad = 0.05;

// Number of samples of which, with the demanded confidence, one has no outlier.
int samples_needed(int inliers, int count, int sample_size, const ConsensusOptions& options) {
  double clean = 1;
  for (int i = 0; i < sample_size; ++i)
    clean *= std::max(0.0, static_cast<double>(inliers - i) / (count - i));
  if (clean >= 1) return 1;
  const double needed = std::log1p(-options.confidence) / std::log1p(-clean);
  return needed < options.max_iterations ? static_cast<int>(std::ceil(needed))
                                         : options.max_iterations;
}

class Search {
 public:
  Search(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& bearings, const SeenPoints& seen,
         const ConsensusOptions& options)
      : points_(points),
        bearings_(bearings),
        seen_(seen),
        options_(options),
        cost_of_(seen, bearings, options.sample_sigmas),
        random_(options.seed),
        sample_size_(options.up_in_cam ? 2 : 3),
        bar_(static_cast<float>(seen.count())) {
    best_.cost = seen.count();
    two_.up_in_cam = options.up_in_cam;
    two_.points.resize(3, 2);
    two_.bearings.resize(3, 2);
  }

  Consensus run() {
    int needed = needed_for(options_.min_inliers);
    while (best_.iterations < needed) {
      ++best_.iterations;
      draw();
      const int count = options_.up_in_cam ? solve_two() : solve_three();
      for (int i = 0; i < count; ++i) {
        const Rigid3& pose = poses_[i];
        const float cost = cost_of_(pose, bar_ + near_cost);
        if (!(cost < bar_ + near_cost)) continue;
        if (cost < bar_)
          bar_ = cost;
        else if ((near_samples_ + 1) * iterations_per_near <= best_.iterations)
          ++near_samples_;
        else
          continue;
        improve(pose);
        needed = needed_for(std::max(options_.min_inliers, static_cast<int>(best_.inliers.size())));
      }
    }
    best_.confident = needed < options_.max_iterations;
    return best_;
  }

 private:
  int needed_for(int inliers) const {
    return samples_needed(std::min(inliers, seen_.count()), seen_.count(), sample_size_, options_);
  }

  void draw() {
    const int n = seen_.count();
    for (int i = 0; i < sample_size_; ++i) {
      int& drawn = sample_[i];
      do drawn = random_.below(n);
      while (std::find(sample_.begin(), sample_.begin() + i, drawn) != sample_.begin() + i);
    }
  }

  int solve_three() {
    Eigen::Matrix3d bearings, points;
    for (int k = 0; k < 3; ++k) {
      bearings.col(k) = bearings_.col(sample_[k]);
      points.col(k) = points_.col(sample_[k]);
    }
    return p3p_within(bearings, points, sample_tolerance_rad, poses_);
  }

  int solve_two() {
    for (int k = 0; k < 2; ++k) {
      two_.bearings.col(k) = bearings_.col(sample_[k]);
      two_.points.col(k) = points_.col(sample_[k]);
    }
    two_poses_.clear();
    upright_p2p_solver.solve(two_, two_poses_);
    std::copy(two_poses_.begin(), two_poses_.end(), poses_.begin());
    return static_cast<int>(two_poses_.size());
  }

  void find_inliers(const Rigid3& pose, double sigmas, std::vector<int>& indices) {
    each_chi2(seen_, pose, chi2_);
    indices.clear();
    for (int i = 0; i < seen_.count(); ++i)
      if (chi2_[i] < sigmas * sigmas) indices.push_back(i);
  }

  // Least squares over the inliers, of the wide gate at first, until they no longer change.
  void improve(Rigid3 pose) {
    constexpr int max_rounds = 10, steps = 5;
    constexpr double tolerance = 0.05;
    std::vector<int> indices, before;
    find_inliers(pose, options_.sample_sigmas, indices);
    for (int round = 0; round < max_rounds && indices != before; ++round) {
      if (static_cast<int>(indices.size()) < 3) return;
      SeenPoints chosen;
      chosen.reserve(static_cast<int>(indices.size()));
      for (const int i : indices) chosen.add(seen_, i);
      const PointFit fit = fit_points(chosen, pose, steps, tolerance);
      if (!std::isfinite(fit.equations.chi2) || !fit.pose.translation.allFinite()) break;
      pose = fit.pose;
      before.swap(indices);
      find_inliers(pose, options_.gate_sigmas, indices);
    }
    update_best(pose, indices);
  }

  void update_best(const Rigid3& pose, const std::vector<int>& indices) {
    double cost = seen_.count();
    for (const int i : indices)
      cost -= 1 - chi2_[i] / (options_.gate_sigmas * options_.gate_sigmas);
    if (!(cost < best_.cost)) return;
    best_.cost = cost;
    best_.pose = pose;
    best_.inliers = indices;
  }

  const Eigen::Matrix3Xd& points_;
  const Eigen::Matrix3Xd& bearings_;
  const SeenPoints& seen_;
  const ConsensusOptions& options_;
  ConsensusCost cost_of_;
  Random random_;
  int sample_size_;
  // Cost of the best sample so far, with the wide gate. An improved pose would hide samples of
  // another one that has more inliers, but whose samples carry more noise.
  float bar_;
  int near_samples_ = 0;  // improved
  Consensus best_;
  std::array<int, 3> sample_{};
  std::array<Rigid3, 4> poses_;
  PoseProblem two_;
  std::vector<Rigid3> two_poses_;
  std::vector<double> chi2_;
};

}  // namespace

Consensus find_consensus(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& bearings,
                         const SeenPoints& seen, const ConsensusOptions& options) {
  return Search(points, bearings, seen, options).run();
}

}  // namespace occ::internal::pose
