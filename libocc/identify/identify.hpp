// SPDX-License-Identifier: Apache-2.0
// Assignment of blobs to lamps, by blink frequency or code, by geometry, or both; with or without a
// prior.
//
// A blob whose code or frequency matches a lamp is assigned to it. All other blobs are assigned by
// geometry: small groups of blobs are assigned to lamps, which yields candidate poses (three blobs
// by P3P; two with known gravity). The remaining lamps are projected and matched within gates that
// follow from the covariances of blobs and pose. All poses consistent with the map are returned,
// each with its probability.
//
// If that yields no pose, the outlines of single lamps do: corners, Lame curves and polygons
// determine it but for mirror poses and turns, and a disc but for its turn, which the direction of
// a second lamp or a prior may determine.
//
// The probabilities follow from the evidence of each pose (pose/internal/evidence.hpp): places,
// sizes, fluxes and codes of the blobs, lamps that are missed, blobs that are left, and the prior.
// "None of these", with all blobs false lights, competes with them. locate() decides in the same
// way, with the rims of large lamps as well.
//
// Maps of seven lamps and more are searched by voting (internal/hypothesis_voting.hpp). Then only
// neighbouring lamps are combined in one group, and a pose is rejected if the penalty of its missed
// lamps outweighs the evidence of its pairs.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/identify/lamp_index.hpp"
#include "libocc/identify/pose_circle.hpp"
#include "libocc/identify/symmetry.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/scene/object.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Search methods for candidate poses. They share verification and ranking, and differ in time and
/// in the poses that they can miss.
enum class IdentifyMethod {
  automatic,   ///< alignment for fewer than seven lamps and for coded blobs; hashing if an
               ///< applicable index is given; otherwise voting
  alignment,   ///< verifies all assignments of a few blob triples (Fischler, Bolles 1981, sec. IV;
               ///< Huttenlocher, Ullman 1990)
  voting,      ///< scores all assignments in single precision and verifies the best
  ransac,      ///< verifies random assignments until one was correct with a probability of 99.9 %
               ///< (Fischler, Bolles 1981); can miss rivals and report a symmetric layout as unique
  clustering,  ///< counts the poses of many triples in cells and verifies the fullest cells
               ///< (generalised Hough transform: Ballard 1981; Stockman 1987)
  hashing,     ///< looks up triangles of blobs by shape, as star trackers do; requires gravity and
               ///< most lamps at one height, otherwise voting
};

/// Options of identify(); the defaults suit calibrated cameras.
struct LIBOCC_API IdentifyOptions {
  std::optional<Prior> prior;  ///< knowledge of the pose besides the image
  /// Search method; `automatic` suits most maps.
  IdentifyMethod method = IdentifyMethod::automatic;
  std::uint64_t seed = 0;           ///< seed of ransac
  std::optional<LampIndex> index;   ///< index of the scene's lamps for hashing; computed if absent
  bool use_frequency = true;        ///< use blink frequencies
  double frequency_gate_sigma = 4;  ///< gate between a blob's frequency and a lamp's [sigma]
  double frequency_tolerance = 0.02;  ///< relative error of lamp and row clocks
  double gate_sigma = 4;              ///< gate between a projected lamp and a blob [sigma]
  double model_sigma_px = 0.5;        ///< error of camera and map, added to every gate [px]
  double miss_penalty = 6;     ///< chi-square of a lamp that should be visible but matches no
                               ///< blob (e^-3); not applied behind boxes of the scene
  bool use_brightness = true;  ///< rank poses of equal support by the lamps' power, and reject
                               ///< poses of fainter reflections; for blobs with flux_sigma_dn > 0
  double light_sigma = 0.2;  ///< relative error of a predicted flux besides the lamp's power_sigma:
                             ///< Lambertian order, angle, light from walls, dirt, vignetting
  int max_hypotheses = 1000000;  ///< maximum number of assignments of three blobs, about 0.3 s; the
                                 ///< message reports when the limit is reached
  /// Maximum time of the search [s]. A search that reaches it is cut short, and its result depends
  /// on the speed of the machine.
  double max_time_s = std::numeric_limits<double>::infinity();
  double max_risk = 1e-4;  ///< a pose is ok if it is wrong with at most this probability

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A pose with the assignment of blobs to lamps.
struct Hypothesis {
  Rigid3 cam_from_world;       ///< coarse, from centroids
  std::vector<Match> matches;  ///< sorted by lamp; includes cut or merged blobs at the predicted
                               ///< image of a lamp, which do not count in the ranking
  /// Centroids and prior, plus miss_penalty for each missed lamp. Each pair less than another
  /// hypothesis has counts as its likelihood against that of a false light.
  double chi2 = 0;
  int missed = 0;              ///< lamps that should be visible but match no blob
  double brightness_chi2 = 0;  ///< fluxes, up to one common gain, and sizes; included in chi2 where
                               ///< brightness ranks the poses
  std::optional<Symmetry> symmetry;  ///< motion from the best hypothesis to this one
  double probability = 0;            ///< that it is right, among all hypotheses and "none of these"
};

/// All plausible assignments of an image.
struct Identification {
  std::vector<Hypothesis> hypotheses;  ///< most probable first
  double risk = 1;         ///< probability that the first hypothesis is wrong; 1 without any
  int tried = 0;           ///< assignments of three blobs tried
  double chance = 0;       ///< expected number of wrong poses that match as many blobs
  bool cut_short = false;  ///< the search stopped at max_hypotheses or max_time_s
  double untried = 0;  ///< share of the groups of blobs that a search that was cut short left out
  /// Poses that only the prior excludes, with nearly as many blobs at another place that looks
  /// alike, or with more. If the prior is wrong, one of them may be right.
  std::vector<Hypothesis> excluded;
  /// The symmetries of the map were searched for such poses. They are not if fewer than four lamps
  /// match or if all of these are collinear.
  bool excluded_listed = false;
  /// Without hypotheses, in an image of one or two blobs: poses that one disc allows. Discs of the
  /// map that the prior permits are all listed.
  std::vector<PoseCircle> circles;
};

/// Assigns blobs to the lamps of a valid scene.
///
/// Once three lamps are identified by codes, a blob without a code is not assigned to a blinking
/// lamp. The search keeps poses with at most a sixth fewer pairs than the largest number of pairs.
/// Those with a probability of at least 1e-6 are listed.
///
/// Status: ok (the risk is at most max_risk); ambiguous (it is not); no_pose (it is more probable
/// that no hypothesis is right; or none matches four blobs, or three that are coded, supported by a
/// prior, or the only ones); too_few_lamps (fewer than three whole blobs or lamps, and no outline
/// that determines a pose); degenerate (all lamps are collinear; without a prior also if the
/// matched lamps are collinear within the blobs' errors and model_sigma_px). Throws
/// std::invalid_argument for invalid options and blobs that are not finite.
LIBOCC_API Result<Identification> identify(const std::vector<Blob>& blobs, const Scene& scene,
                                           const IdentifyOptions& options = {});

/// Assigns blobs to the points of a valid object. The world frame, also in the prior, is the
/// object's frame; a match's `lamp` is an index of its points. Only covisible points form a group.
LIBOCC_API Result<Identification> identify_object(const std::vector<Blob>& blobs,
                                                  const Object& object, const Camera& camera,
                                                  const IdentifyOptions& options = {});

}  // namespace occ
