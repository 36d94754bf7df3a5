// SPDX-License-Identifier: Apache-2.0
// Which blob is which lamp: by blink frequency, by geometry alone, or both; with or without a
// prior. Blobs whose frequency matches one lamp's code are named by it; all others are matched by
// geometry: a pose for every assignment of lamps to a few blob triples (P3P; pairs, when gravity is
// known), the rest of the map projected and matched within gates that follow from the measurement's
// covariance. All poses consistent with the map are returned, ranked. In maps of seven lamps and
// more the poses are voted on first (identify/internal/ballot.hpp); there only lamps that are
// neighbours are assigned to one triple, and a pose from which more lamps are missing than its
// matches can outweigh is none.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/identify/lamp_index.hpp"
#include "libocc/identify/symmetry.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/scene/object.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// How poses that explain an image are searched for. All end in the same verdict; they differ in
/// time, and in what they may miss.
enum class IdentifyMethod {
  automatic,  ///< alignment for maps of fewer than seven lamps and where codes name blobs; hashing
              ///< where an index is given that applies; else voting
  alignment,  ///< every naming of a few blob triples gives poses, the rest is projected and
              ///< verified (Fischler, Bolles 1981, sec. IV; Huttenlocher, Ullman 1990)
  voting,     ///< the same for all namings in single precision; only the winners are verified
  ransac,     ///< random namings of random triples until 99.9 % sure that one was all true
           ///< (Fischler, Bolles 1981); misses rivals, so that a repeating layout may look unique
  clustering,  ///< poses of the namings of many triples; where they accumulate is looked at
               ///< (generalised Hough transform: Ballard 1981; Stockman 1987)
  hashing,     ///< triangles of neighbours are looked up by their shape, as star trackers do; where
               ///< gravity is known and most lamps hang at one height, else voting
};

struct LIBOCC_API IdentifyOptions {
  std::optional<Prior> prior;
  IdentifyMethod method = IdentifyMethod::automatic;
  std::uint64_t seed = 0;          ///< of ransac
  std::optional<LampIndex> index;  ///< of the scene's lamps, for hashing; none: made anew
  bool use_frequency = true;
  double frequency_gate_sigma = 4;    ///< a blob's frequency and a lamp's code agree within this
  double frequency_tolerance = 0.02;  ///< relative; lamps and row clocks are not exact
  double gate_sigma = 4;              ///< a projected lamp and a blob agree within this
  double model_sigma_px = 0.5;        ///< error of the camera and map, added to every gate
  double miss_penalty = 6;     ///< chi-square for a lamp that should be seen but is not (e^-3), its
                               ///< centre not being behind one of the scene's boxes
  bool use_brightness = true;  ///< tell poses that fit equally well apart by the lamps' power, and
                               ///< reflections by their being weaker; of blobs with a flux_sigma_dn
  double light_sigma = 0.2;  ///< relative error of a predicted flux beyond the lamp's power_sigma:
                             ///< of order and angle, walls' light, dirt, vignetting
  int max_hypotheses = 1000000;  ///< namings of three blobs tried (a third of a second); the
                                 ///< message says when it ended the search

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// One way to explain the image.
struct Hypothesis {
  Rigid3 cam_from_world;       ///< coarse: from centroids
  std::vector<Match> matches;  ///< sorted by lamp; includes blobs cut by the border or merged that
                               ///< are where a lamp must be (they do not count in the ranking)
  double chi2 = 0;             ///< of the matched centroids and the prior, plus the miss penalties
  int missed = 0;              ///< lamps that should be in view but match no blob
  double brightness_chi2 = 0;  ///< of fluxes and sizes about one common gain; counts in chi2 where
                               ///< brightness tells poses apart
  std::optional<Symmetry> symmetry;  ///< from the best hypothesis to this one
};

struct Identification {
  std::vector<Hypothesis> hypotheses;  ///< smallest chi2 first
  int tried = 0;                       ///< namings of three blobs tried
  double chance = 0;  ///< expected number of wrong poses that explain as many blobs by accident
  bool may_be_chance = false;  ///< the one plausible pose is not sure enough: `chance` is above
                               ///< 0.1, above 0.01 where lamps are missing; or it leaves blobs
                               ///< unexplained and fits badly
};

/// Once three lamps are named by their codes, a blob without a code is taken for no coded lamp.
/// Plausible are the hypotheses that explain the most whole blobs and are no less likely than
/// 1/1000 of the best of them, by brightness, too, when the best of them is as bright as its lamps
/// let expect; those that only miss more lamps (up to three: they are switched in
/// groups) are listed, too. Status: ok (one plausible), ambiguous (several), too_few_lamps (fewer
/// than three whole blobs or lamps), no_pose (nothing explains four blobs, or three that are named,
/// backed by a prior or all there are), degenerate (all lamps on a line; without a prior also when
/// those that explain the blobs are on one as far as the blobs' errors and model_sigma_px let that
/// be seen). Throws std::invalid_argument for options out of range and blobs that are not finite;
/// the scene must be valid.
LIBOCC_API Result<Identification> identify(const std::vector<Blob>& blobs, const Scene& scene,
                                           const IdentifyOptions& options = {});

/// The same for the points of an object: cam_from_world, and "world" in the prior, are then of the
/// object's frame, and a match's `lamp` is an index of its points. Only points that a camera can
/// see together are assigned to one triple. The object must be valid.
LIBOCC_API Result<Identification> identify_object(const std::vector<Blob>& blobs,
                                                  const Object& object, const Camera& camera,
                                                  const IdentifyOptions& options = {});

}  // namespace occ
