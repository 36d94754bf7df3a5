// SPDX-License-Identifier: Apache-2.0
// Hashing of lamp patterns: triangles of blobs are looked up by their shape, as star trackers do
// with triples of stars (Liebe, "Star trackers for attitude determination", IEEE AES Magazine 10,
// 1995; Lamdan, Wolfson, "Geometric hashing", ICCV 1988). A perspective image of unknown tilt has
// no invariant of three or four points of a plane that could be looked up: gravity must be known,
// and most lamps hang at one height.
#include "libocc/identify/internal/search.hpp"
#include "libocc/identify/internal/shape_ballot.hpp"
#include "libocc/identify/lamp_index.hpp"

namespace occ::internal::identify {

void Search::hash() {
  if (!problem_.scene || !prior_ || !problem_.options->prior->gravity_in_cam) {
    vote();
    return;
  }
  const LampIndex index =
      problem_.options->index ? *problem_.options->index : LampIndex(problem_.scene->lamps);
  if (!index.applies()) {
    vote();
    return;
  }
  by_shape_ = true;
  ShapeBallot ballot(problem_, index.table());
  run_poll({ballot.knows_neighbours_only(),
            [&](const std::array<int, 3>& s, int least, std::vector<Vote>& votes) {
              ballot.of_three(s, least, votes);
            },
            [&]() -> const Turnout& { return ballot.turnout(); }});
}

}  // namespace occ::internal::identify
