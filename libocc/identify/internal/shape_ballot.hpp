// SPDX-License-Identifier: Apache-2.0
// Internal: a vote over the namings of three blobs by lamps of one height that are the corners of a
// triangle of the same shape, gravity being known. Blobs are taken to where their rays meet a plane
// one above the camera: there they are a similar image of the map.
#pragma once

#include <array>
#include <vector>

#include "libocc/identify/internal/ballot.hpp"
#include "libocc/identify/internal/lamp_table.hpp"
#include "libocc/identify/internal/prior_gate.hpp"

namespace occ::internal::identify {

class ShapeBallot {
 public:
  ShapeBallot(const AssignmentProblem& problem, const LampTable& table);

  /// Adds all votes for at least `least` others, always in the same order.
  void of_three(const std::array<int, 3>& sightings, int least, std::vector<Vote>& votes);

  const Turnout& turnout() const { return turnout_; }
  bool knows_neighbours_only() const;

 private:
  /// A blob in the plane one above the camera (or below: then its rays run backwards).
  struct Levelled {
    Complex at;
    std::array<Complex, 2> tilted;  ///< the same for gravity off by its sigma, two ways
    double sigma = 0;
    int side = 0;  ///< 1 above, -1 below; 0 too near the horizon
  };
  struct Trio;

  double shape_error(const std::array<const Levelled*, 3>& corners) const;
  double place_error(const Trio& trio, int sighting) const;
  void judge(const Trio& trio, const std::array<int, 3>& lamps, int least,
             std::vector<Vote>& votes);

  const AssignmentProblem& problem_;
  const LampTable& table_;
  Eigen::Matrix3d cam_from_upright_;
  PriorGate gate_;
  double image_area_ = 0;  // in the plane one above, of a level camera
  std::vector<Levelled> levelled_;
  Turnout turnout_;
};

}  // namespace occ::internal::identify
