// SPDX-License-Identifier: Apache-2.0
// Constellation of lamps that pictures show, without a map: the result of survey(), and lamps that
// it lacks because their size differs or because they have no rim. These are intersected from the
// blobs without a lamp: the point near the rays of most pictures, three or more.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/network.hpp"
#include "libocc/survey/internal/lamp_light.hpp"
#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// A blob whose observation the adjustment rejected.
struct RejectedBlob {
  int picture = 0, blob = 0, lamp = 0;  ///< indices; lamp: of the block
};

/// A lamp of a block.
struct BlockLamp {
  int number = -1;         ///< id in the survey; -1: it was not in the survey
  Lamp lamp;               ///< centre, shape, size and normal
  bool has_shape = false;  ///< false: a point without a normal of its own
  RelativeLight light;     ///< in a unit that all blocks share
  LampSignal signal;
  std::vector<int> pictures;  ///< indices of the pictures with an observation
  /// Largest angle between the directions of two views. A single view of a disc has two normals.
  double spread_rad = 0;
};

/// Pictures that match each other.
class LampBlock {
 public:
  /// Completes a survey that is ok.
  LampBlock(const Survey& found, const std::vector<SurveyPicture>& pictures, const Camera& camera,
            int threads);

  const std::vector<BlockLamp>& lamps() const { return lamps_; }
  /// Pose of a picture; nothing if it is not in the block.
  std::optional<Rigid3> pose(int picture) const;
  const std::vector<int>& pictures() const { return picture_of_image_; }
  /// Lamp of each blob of a picture; -1: none.
  const std::vector<int>& lamp_of_blob(int picture) const { return lamp_of_blob_[picture]; }
  const std::vector<std::string>& warnings() const { return warnings_; }
  std::vector<RejectedBlob> rejected() const;

  /// Light of a lamp with the normal and the emission of another one.
  RelativeLight light_as(const Lamp& emitter, int lamp) const;

  /// Moves poses and lamps.
  void transform(const Similarity& similarity);
  /// Joint covariance of the lamps' places, in the datum of all lamps.
  Eigen::MatrixXd covariance() const;

 private:
  struct Ray {
    int image, blob;
    Eigen::Vector3d origin, direction;
    double sigma_rad;
  };
  struct Intersection {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    std::vector<Ray> rays;
  };

  std::vector<Ray> rays_without_lamp() const;
  Intersection best_intersection(const std::vector<Ray>& rays) const;
  Intersection supported(const Eigen::Vector3d& at, const std::vector<Ray>& rays) const;
  bool add_missed_lamps();
  void adjust_again();
  Eigen::Vector2d centre_correction(const BlockLamp& lamp, const Rigid3& pose) const;
  void update_lamps();
  void remove_undetermined();
  double model_sigma_px() const;

  const std::vector<SurveyPicture>& pictures_;
  const Camera& camera_;
  int threads_;
  Network network_;
  double variance_factor_ = 1;
  double model_sigma_px_ = 0.02;
  std::vector<int> picture_of_image_, point_of_lamp_;
  std::vector<std::vector<int>> lamp_of_blob_;
  std::vector<BlockLamp> lamps_;
  std::vector<std::string> warnings_;
};

}  // namespace occ::internal::survey
