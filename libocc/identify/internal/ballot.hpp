// SPDX-License-Identifier: Apache-2.0
// Internal: a vote over all namings of a few blobs. Each naming of three blobs (or of two, when
// gravity is known) by lamps that can be seen together gives up to four poses (two), and each pose
// the number of other blobs that have a lamp in their gate: this is counted in single precision,
// for many namings at once, with gates that follow from the blobs' errors to first order. Only the
// winners are worth a proper look. Lamps can be seen together when each is among the nearest
// neighbours of the first: others have so many between them that the image would show those, too.
#pragma once

#include <array>
#include <vector>

#include "libocc/identify/internal/explain.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/identify/internal/seen_together.hpp"
#include "libocc/identify/internal/vote_kernels.hpp"

namespace occ::internal::identify {

struct Vote {
  std::vector<Pair> naming;  ///< of three or two blobs
  Rigid3 pose;               ///< camera from the local frame, good to about 1e-4
  int further = 0;           ///< other blobs with a lamp in their gate
};

/// What was voted on.
struct Turnout {
  int namings = 0;
  double poses = 0;    ///< from which the first lamp shows its lit side
  double visible = 0;  ///< lamps in view besides those named, summed over these poses
};

class Ballot {
 public:
  Ballot(const AssignmentProblem& problem, SeenTogether& together);

  /// Adds all votes for at least `least` others, always in the same order.
  void of_three(const std::array<int, 3>& sightings, int least, std::vector<Vote>& votes);
  /// The same for two blobs; the prior must know gravity.
  void of_two(const std::array<int, 2>& sightings, int least, std::vector<Vote>& votes);

  const Turnout& turnout() const { return turnout_; }
  /// Whether the map has more lamps than are taken for neighbours.
  bool knows_neighbours_only() const;

 private:
  struct Neighbours {
    std::vector<int> targets;     // nearest first
    std::vector<NearLamp> lamps;  // about the lamp whose neighbours they are
  };
  /// Namings of two more blobs by neighbours of a first lamp; and poses that follow from them.
  struct Table {
    std::array<std::vector<float>, 3> second_place, third_place;
    std::vector<int> second, third;
    void resize(std::size_t size);
    void copy(std::size_t from, const Table& other, std::size_t to);
    Places places() const;
  };

  Jury jury(int first, const std::vector<int>& sightings, const std::vector<Other>& others);
  Judged judged() const;
  int image_turn(const std::array<int, 3>& sightings) const;
  void solve(const NamedTriples& blobs, std::size_t namings);
  std::size_t add_namings(const std::array<int, 3>& sightings, int first, int image_turn);
  void pad_poses(std::size_t count);
  std::size_t add_poses(std::size_t namings);
  std::size_t add_headings(const std::array<int, 2>& sightings, int first, const PriorGate& gate,
                           double relative);
  bool counts(std::size_t pose, int least);
  Rigid3 pose_of_three(const std::array<int, 3>& sightings, const std::array<int, 3>& targets,
                       std::size_t pose) const;

  const AssignmentProblem& problem_;
  SeenTogether& together_;
  Simd simd_;
  double unit_m_ = 1;  // of single-precision numbers
  Frustum frustum_;
  std::size_t named_ = 0;  // neighbours that are named; the others are looked for in the image
  std::vector<Neighbours> neighbours_;
  Table namings_, judged_;
  std::array<std::vector<float>, 3> depths_, parameters_;
  std::vector<int> valid_, further_, visible_;
  std::vector<unsigned char> may_be_;
  Turnout turnout_;
};

}  // namespace occ::internal::identify
