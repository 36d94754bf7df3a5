// SPDX-License-Identifier: Apache-2.0
// Comparison of an old map with places measured in new pictures, by generalised least squares.
//
// The map has the places x = p + e_x with the joint covariance S, the pictures y = p + e_y with W.
// The pictures determine their frame and scale up to a similarity, so that W contains its seven
// directions with a large variance (add_free_similarity). Over the lamps that did not move,
//
//     d = x - y,  C = S + W,  Q = C^-1.
//
// The test of a lamp i that is among them compares its d with the prediction by the others:
//
//     r_i = Q_ii^-1 (Q d)_i,  cov(r_i) = Q_ii^-1,  T_i = r_i^T Q_ii r_i,
//
// of a lamp that is not among them r_i = d_i - C_iU Q d with cov(r_i) = C_ii - C_iU Q C_Ui. T_i has
// a chi-square distribution with 3 degrees of freedom if the lamp did not move (Baarda's test of
// one group of observations). The best estimates of both kinds of places are
//
//     x' = x - S Q d,  y' = y + W Q d,  cov = B - H Q H^T,
//
// with the prior covariance B and the covariance H with d (Koch, "Parameter estimation and
// hypothesis testing in linear models", 1999, section 3.4.4).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::survey {

/// Adds the variances of a free similarity to a joint covariance (3n x 3n) of places: a tenth of
/// their extent in each direction, and as much at their border by rotation and by scale. Errors of
/// the first alignment are millimetres, which the information of 1 / (variance) does not pull.
LIBOCC_API void add_free_similarity(const Eigen::Matrix3Xd& places,
                                    Eigen::Ref<Eigen::MatrixXd> covariance);

/// Part of a joint covariance that no similarity of the places explains: (I - P) S (I - P) with the
/// projection P on the seven directions. Errors such as the height of a ceiling do not change the
/// constellation of the lamps.
LIBOCC_API Eigen::MatrixXd without_similarity(const Eigen::Matrix3Xd& places,
                                              const Eigen::MatrixXd& covariance);

/// A lamp of the map and its measured place.
struct PlacePair {
  int lamp = 0;   ///< column of the map
  int place = 0;  ///< column of the measured places
};

/// Comparison of one pair.
struct PlaceTest {
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();  ///< new minus old place
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  double statistic = 0;  ///< T
};

/// An estimate that PlaceStatistics::estimate() returns.
struct PlaceItem {
  enum class Kind {
    kept,    ///< place in the map, unchanged
    fused,   ///< place in the map, improved by the pictures
    placed,  ///< measured place in the frame of the map
  };
  Kind kind = Kind::kept;
  int index = 0;  ///< column of the map, or of the measured places
};

/// Places with their joint covariance, in the order of the items.
struct PlaceEstimate {
  Eigen::Matrix3Xd places;
  Eigen::MatrixXd covariance;  ///< 3n x 3n
};

/// Map and measured places, both in the frame of the map to first order.
class LIBOCC_API PlaceStatistics {
 public:
  PlaceStatistics(Eigen::Matrix3Xd map, Eigen::MatrixXd map_covariance, Eigen::Matrix3Xd places,
                  Eigen::MatrixXd places_covariance);

  /// Sets the lamps that did not move. Returns false if C is not positive definite.
  bool set_unchanged(std::vector<PlacePair> pairs);
  bool is_unchanged(const PlacePair& pair) const;

  /// Test of a pair that is among the unchanged ones or not.
  PlaceTest test(const PlacePair& pair) const;

  /// Moves pairs with T > max_statistic out of the unchanged ones, the largest T first, and others
  /// with T below it back, the smallest first, until nothing changes. At least `min_unchanged`
  /// pairs are kept.
  void separate(const std::vector<PlacePair>& all, double max_statistic, int min_unchanged);

  PlaceEstimate estimate(const std::vector<PlaceItem>& items) const;

 private:
  Eigen::MatrixXd covariance_of(const PlacePair& a, const PlacePair& b) const;
  /// Covariance (3 x 3|U|) of an item's error with d.
  Eigen::MatrixXd covariance_with_differences(const PlaceItem& item) const;

  Eigen::Matrix3Xd map_, places_;
  Eigen::MatrixXd s_, w_, q_;
  std::vector<PlacePair> unchanged_;
  Eigen::VectorXd qd_;
};

}  // namespace occ::internal::survey
