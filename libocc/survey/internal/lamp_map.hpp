// SPDX-License-Identifier: Apache-2.0
// Map of lamps that grows picture by picture, and its match with a further picture.
//
// The lamps of a picture form a constellation: directions with ranges in units of the lamps' sizes
// (lamp_view.hpp). A match is the rigid motion between map and constellation. Triples of lamps with
// the same distances on both sides give hypotheses, whose motion is refined with all lamps in the
// gate,
//
//     min over R, t of sum e^T (R S_X R^T + S_Y)^-1 e,  e = R X + t - Y.
//
// Normals count as well, with a sigma of 0.3 rad: they determine the rotation about a line of
// lamps.
//
// The expected number of accidental matches as good (a contrario: Desolneux, Moisan, Morel, "From
// gestalt theory to image analysis", 2008) is
//
//     NFA = N_triples * prod of 3 (2 tolerance / field) * prod over further lamps of min(1, n p_i)
//
// with p_i the part of the picture that the gate of lamp i covers and n the number of blobs. Ranges
// and heights do not count, because lamps of one kind on one ceiling have them in common. Of lamps
// on one line in the picture, two sides of the triple and places along the line count only. Each
// contradiction multiplies NFA by 20: a lamp that should be in the picture and is not, or a blob
// that a placed picture should show and does not.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/survey/internal/lamp_view.hpp"

namespace occ::internal::survey {

constexpr double missing_log10 = 1.3;  ///< a lamp is dark or hidden with probability 1/20

/// Solid angle of a camera's field of view [sr], of a small one; at most half of all directions.
double field_of_view_sr(const Camera& camera);

/// A lamp of the map; lengths have any common unit.
struct MapLamp {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  int tag = -1;  ///< number of a tag; -1: a lamp
  LampShape shape = LampShape::disc;
  double aspect = 1;                                   ///< longer over shorter side of a rectangle
  double size = 1;                                     ///< as in LampShapeView
  double size_sigma = 0;                               ///< relative
  Eigen::Vector3d normal = -Eigen::Vector3d::UnitZ();  ///< towards the lit side
  /// Direction of the longer side of a rectangle; zero if it is not known, or for a disc.
  Eigen::Vector3d x_axis = Eigen::Vector3d::Zero();
};

/// A picture with its views.
struct PictureViews {
  const std::vector<Blob>* blobs = nullptr;  ///< all blobs of the picture
  std::vector<LampShapeView> views;          ///< blobs with a measured shape
};

/// A picture in the map.
struct PlacedPicture {
  int picture = 0;           ///< index into the list of pictures
  Rigid3 cam_from_map;       ///< pose
  std::vector<int> lamp_of;  ///< lamp of each blob of the picture; -1: none
};

/// A hypothesis of match_picture().
struct MapMatch {
  Rigid3 cam_from_map;                   ///< refined motion
  Matrix6 covariance = Matrix6::Zero();  ///< covariance of its left perturbation
  std::vector<int> lamp_of_view;         ///< one per view; -1: none
  int matches = 0;                       ///< number of views with a lamp
  int contradictions = 0;                ///< lamps and blobs that are absent where they should be
  double log10_false_alarms = 0;         ///< base-10 logarithm of NFA
};

/// The map with the pictures that it was made from.
struct LampMap {
  std::vector<MapLamp> lamps;
  std::vector<PlacedPicture> placed;
};

/// Lamp of the map as a view shows it: X = range * size * bearing, with its covariance, in the
/// camera's frame.
Eigen::Vector3d view_position(const LampShapeView& view, double size);
/// Covariance of view_position(); size_sigma is relative.
Eigen::Matrix3d view_covariance(const LampShapeView& view, double size, double size_sigma);

/// Lamps of the map that each view may show; empty: all lamps.
using MatchCandidates = std::vector<std::vector<int>>;

/// Hypotheses with at least three matches, or a tag and a lamp, and different assignments, most
/// significant first. `neighbour`: pose of a picture from nearly the same place and direction, if
/// any; without other hypotheses, those of two lamps are given.
std::vector<MapMatch> match_picture(const PictureViews& picture, const LampMap& map,
                                    const std::vector<PictureViews>& pictures, const Camera& camera,
                                    const MatchCandidates& candidates = {},
                                    const Rigid3* neighbour = nullptr);

/// Hypotheses of one picture, reduced to an answer.
struct MatchVerdict {
  enum class Kind { matched, ambiguous, none };
  Kind kind = Kind::none;
  int ways = 0;  ///< number of plausible hypotheses
};

/// Decides about hypotheses in the order of match_picture(). A rival with at least half the matches
/// of the first and as few contradictions makes it ambiguous: in a regular arrangement, the number
/// of matches is no evidence, because every shift by one lamp matches many.
MatchVerdict judge_matches(const std::vector<MapMatch>& matches, double max_log10_false_alarms,
                           int min_matches);

}  // namespace occ::internal::survey
