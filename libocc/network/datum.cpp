// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/datum.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/internal/datum_directions.hpp"

namespace occ {

using namespace internal::network;

namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Row = Eigen::Matrix<double, 1, 7>;

/// Exponential map of (rotation, translation, log scale) about the defect's pivot. It is the
/// exponential of the similarity group, so a subgroup's fixed points remain fixed. Computed by
/// scaling and squaring with 18 terms of the series.
Similarity similarity_of(const DatumDefect& defect, const Eigen::VectorXd& amount) {
  const Eigen::Matrix<double, 7, 1> along = defect.directions * amount;
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = skew(along.head<3>()) + along[6] * Matrix3d::Identity();
  generator.topRightCorner<3, 1>() = defect.extent_m * along.segment<3>(3);
  const double size = generator.cwiseAbs().maxCoeff();
  const int halvings = size > 0.25 ? static_cast<int>(std::ceil(std::log2(size / 0.25))) : 0;
  generator *= std::ldexp(1.0, -halvings);
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity(), sum = term;
  for (int k = 1; k <= 18; ++k) {
    term = term * generator / k;
    sum += term;
  }
  for (int k = 0; k < halvings; ++k) sum = (sum * sum).eval();
  Similarity similarity;
  similarity.scale = std::exp(along[6]);
  similarity.rotation = nearest_rotation(sum.topLeftCorner<3, 3>());
  similarity.translation = sum.topRightCorner<3, 1>() + defect.pivot_m -
                           similarity.scale * (similarity.rotation * defect.pivot_m);
  return similarity;
}

/// Constraint rows over (rotation, translation / extent, log scale); their null space is the
/// defect.
class DatumConstraints {
 public:
  explicit DatumConstraints(const DatumDefect& frame) : frame_(frame) {}

  void add_position(const Vector3d& position_m) {
    const Eigen::Matrix3Xd jacobian = similarity_jacobian(frame_, position_m) / frame_.extent_m;
    for (Index k = 0; k < 3; ++k) add(jacobian.row(k));
  }
  /// `centre`: the point of the pose's frame about which it scales (ScaleCentres).
  void add_pose(const Rigid3& from_world, const Vector3d& centre = Vector3d::Zero()) {
    Row row = Row::Zero();
    for (int k = 0; k < 3; ++k) {
      row.setZero();
      row[k] = 1;
      add(row);
    }
    add_position(from_world.inverse() * centre);
  }
  void add_length(double length) {
    if (std::abs(length) <= 1e-9 * frame_.extent_m) return;  // a zero length holds no scale
    Row row = Row::Zero();
    row[6] = 1;
    add(row);
  }
  Eigen::Matrix<double, 7, Eigen::Dynamic> null_space() const {
    if (rows_.empty()) return Eigen::Matrix<double, 7, 7>::Identity();
    MatrixXd all(static_cast<Index>(rows_.size()), 7);
    for (std::size_t k = 0; k < rows_.size(); ++k) all.row(static_cast<Index>(k)) = rows_[k];
    const auto eigen =
        internal::core::symmetric_eigen<MatrixXd>(internal::core::transposed_product(all, all));
    Index defect = 0;
    while (defect < 7 && eigen.eigenvalues()[defect] < 1e-12 * eigen.eigenvalues()[6]) ++defect;
    return eigen.eigenvectors().leftCols(defect);
  }

 private:
  void add(const Row& row) {
    const double length = row.norm();
    if (length > 1e-9) rows_.push_back(row / length);
  }

  const DatumDefect& frame_;
  std::vector<Row> rows_;
};

void set_pivot(const NetworkState& state, DatumDefect& defect) {
  std::vector<Vector3d> positions = state.points;
  for (const Rigid3& body : state.bodies) positions.push_back(body.translation);
  if (positions.size() < 2)
    for (const Rigid3& station : state.stations) positions.push_back(station.origin_in_source());
  if (positions.empty()) return;
  // Medians, because a point that is left out of the adjustment may be anywhere.
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const Vector3d& position : positions) values.push_back(position[k]);
    defect.pivot_m[k] = median(std::move(values));
  }
  std::vector<double> distances;
  for (const Vector3d& position : positions)
    distances.push_back((position - defect.pivot_m).norm());
  const double extent = median(std::move(distances));
  defect.extent_m = extent > 0 ? extent : 1;
}

/// Adds the known lengths among the parameters of the cameras that took an image.
void add_camera_lengths(const Network& network, const NetworkState& state,
                        const std::vector<char>& height_compensated,
                        DatumConstraints& constraints) {
  std::vector<char> used(network.cameras.size());
  for (const NetworkImage& image : network.images) used[image.camera] = 1;
  for (std::size_t i = 0; i < network.cameras.size(); ++i) {
    if (!used[i]) continue;
    const std::vector<std::string>& free = network.cameras[i].free_parameters;
    for (const CameraParameter& parameter : state.cameras[i].parameters()) {
      bool known = std::find(free.begin(), free.end(), parameter.name) == free.end();
      for (const ParameterPrior& prior : network.parameter_priors)
        if (prior.camera == static_cast<int>(i) && prior.parameter == parameter.name) known = true;
      if (height_compensated[i] && parameter.name == height_name) continue;
      if (known && parameter.is_length) constraints.add_length(parameter.value);
    }
  }
}

/// transformed(), except that known lengths are kept and stations compensate them (ScaleCentres).
Network transformed_keeping_lengths(Network network, const Similarity& similarity) {
  if (similarity.scale == 1) return transformed(std::move(network), similarity);
  const ScaleCentres centres = scale_centres(network, NetworkState(network));
  const std::vector<NetworkMount> mounts = network.mounts;
  const std::vector<NetworkCamera> cameras = network.cameras;
  Network moved = transformed(std::move(network), similarity);
  const double rest = 1 - similarity.scale;
  for (std::size_t i = 0; i < moved.stations.size(); ++i)
    moved.stations[i].station_from_world.translation += rest * centres.station[i];
  for (std::size_t i = 0; i < moved.mounts.size(); ++i) {
    if (mounts[i].fixed)
      moved.mounts[i] = mounts[i];
    else
      moved.mounts[i].cam_from_station.translation += rest * centres.mount[i];
  }
  for (std::size_t i = 0; i < moved.cameras.size(); ++i) {
    if (!centres.height_compensated[i]) continue;
    const std::vector<CameraParameter> parameters = moved.cameras[i].camera.parameters();
    const std::vector<CameraParameter> before = cameras[i].camera.parameters();
    Eigen::VectorXd values(static_cast<Index>(parameters.size()));
    for (std::size_t k = 0; k < parameters.size(); ++k)
      values[static_cast<Index>(k)] =
          (parameters[k].name == height_name ? before : parameters)[k].value;
    moved.cameras[i].camera = moved.cameras[i].camera.with_parameters(values);
  }
  return moved;
}

/// Rotation vector from one outline to another; of a round one, the smallest between the normals.
Vector3d rotation_between(const NetworkOutline& from, const NetworkOutline& to) {
  const Matrix3d &a = from.world_from_outline, &b = to.world_from_outline;
  return so3_log(from.is_round ? shortest_rotation(a.col(2), b.col(2)) : b * a.transpose());
}

}  // namespace

void check_datum(const Network& network, const Datum& datum) {
  for (const Target& target : datum.targets)
    network.name_of(target);  // throws for an invalid target
  const std::size_t count = datum.targets.size();
  if (datum.kind == DatumKind::minimal)
    require(count == 0 || count == 3, "datum.targets", count, "three, or none");
  if (datum.kind == DatumKind::scale_only)
    require(count == 0 || count == 2, "datum.targets", count, "two, or none");
  if (datum.kind == DatumKind::control)
    require(count == 0, "datum.targets", count, "none: control points determine this datum");
}

Network transformed(Network network, const Similarity& similarity) {
  require(similarity.scale > 0 && std::isfinite(similarity.scale), "similarity.scale",
          similarity.scale, "positive");
  const Matrix3d& rotation = similarity.rotation;
  for (NetworkPoint& point : network.points) {
    point.position_m = similarity * point.position_m;
    if (!point.outline) continue;
    point.outline->world_from_outline = rotation * point.outline->world_from_outline;
    point.outline->size_m *= similarity.scale;
  }
  for (NetworkBody& body : network.bodies) {
    body.world_from_body = {rotation * body.world_from_body.rotation,
                            similarity * body.world_from_body.translation};
    body.scale *= similarity.scale;
  }
  for (NetworkStation& station : network.stations) {
    Rigid3& pose = station.station_from_world;
    pose.rotation = pose.rotation * rotation.transpose();
    pose.translation = similarity.scale * pose.translation - pose.rotation * similarity.translation;
  }
  if (similarity.scale == 1) return network;
  for (NetworkMount& mount : network.mounts) mount.cam_from_station.translation *= similarity.scale;
  for (NetworkCamera& camera : network.cameras) {
    const std::vector<CameraParameter> parameters = camera.camera.parameters();
    Eigen::VectorXd values(static_cast<Index>(parameters.size()));
    bool lengths = false;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      values[static_cast<Index>(k)] =
          parameters[k].value * (parameters[k].is_length ? similarity.scale : 1);
      lengths |= parameters[k].is_length;
    }
    if (lengths) camera.camera = camera.camera.with_parameters(values);
  }
  return network;
}

DatumDefect internal::network::defect_at(const Network& network, const NetworkState& state) {
  DatumDefect defect;
  set_pivot(state, defect);
  defect.directions = Eigen::Matrix<double, 7, 7>::Identity();
  DatumConstraints constraints(defect);
  const ScaleCentres centres = scale_centres(network, state);
  constraints.add_length(centres.conflict_m);

  for (std::size_t i = 0; i < network.points.size(); ++i)
    if (network.points[i].fixed) constraints.add_position(state.points[i]);
  std::vector<char> body_used(network.bodies.size()), station_used(network.stations.size());
  for (const ImageObservation& observation : network.observations) {
    if (!observation.used) continue;
    if (observation.target.body >= 0) body_used[observation.target.body] = 1;
    station_used[network.images[observation.image].station] = 1;
  }
  for (std::size_t i = 0; i < network.bodies.size(); ++i) {
    const NetworkBody& body = network.bodies[i];
    if (body.fixed) constraints.add_pose(state.bodies[i].inverse());
    const double size = body.corners_m.colwise().norm().maxCoeff();
    if (body_used[i] && (body.fixed || !body.scale_free)) constraints.add_length(size);
  }
  for (std::size_t i = 0; i < network.stations.size(); ++i)
    if (network.stations[i].fixed && station_used[i])
      constraints.add_pose(state.stations[i], centres.station[i]);
  for (const DistanceObservation& distance : network.distances)
    if (distance.used) constraints.add_length(distance.length_m);
  for (const ControlPoint& control : network.control)
    if (control.used) constraints.add_position(target_position(network, state, control.target));
  for (const PosePrior& prior : network.pose_priors)
    constraints.add_pose(state.stations[prior.station], centres.station[prior.station]);
  add_camera_lengths(network, state, centres.height_compensated, constraints);

  defect.directions = constraints.null_space();
  const auto rank = [&](Index first, Index count) {
    if (defect.directions.cols() == 0) return 0;
    auto svd = internal::core::jacobi_svd<MatrixXd>(defect.directions.middleRows(first, count));
    svd.setThreshold(1e-6);
    return static_cast<int>(svd.rank());
  };
  defect.scale = rank(6, 1);
  defect.rotation = rank(0, 3);
  defect.translation = defect.total() - defect.scale - defect.rotation;
  return defect;
}

DatumDefect datum_defect(const Network& network) {
  return defect_at(network, NetworkState(network));
}

Result<Network> in_datum(const Network& network, const Network& reference, const Datum& datum) {
  check_datum(network, datum);
  require(network.points.size() == reference.points.size() &&
              network.bodies.size() == reference.bodies.size(),
          "reference", reference.points.size(), "a network of the same points and bodies");
  Result<Network> result;
  result.value = network;
  const NetworkLayout layout = layout_of(network);
  const auto fail = [&](const char* message) {
    result.status = Status::degenerate;
    result.message = message;
    result.value = network;
    return result;
  };
  // The defect is invariant under its own subgroup, so it is computed once.
  const DatumDefect defect = datum_defect(network);
  if (defect.total() == 0) return result;
  if (datum.kind == DatumKind::control)
    return fail("control points and other observations do not determine the datum");

  // Inner constraints first: near the reference, Newton's steps on few coordinates converge.
  const Datum inner{DatumKind::inner,
                    datum.kind == DatumKind::inner ? datum.targets : std::vector<Target>{}};
  constexpr int max_steps = 50;
  std::vector<ImageObservation> observations;
  observations.swap(result.value.observations);  // saves copying them in each step
  for (const Datum& current : {inner, datum}) {
    const auto conditions = datum_conditions(reference, layout, current, defect);
    if (!conditions) return fail("the datum's targets do not determine it");
    const Index rows = conditions->rows[0].rows();
    for (int step = 0; step < max_steps; ++step) {
      MatrixXd jacobian = MatrixXd::Zero(defect.total(), defect.total());
      Eigen::VectorXd misclosure = Eigen::VectorXd::Zero(defect.total());
      add_outlines(*conditions, result.value, defect, jacobian);
      for (std::size_t k = 0; k < conditions->targets.size(); ++k) {
        const Target& target = conditions->targets[k];
        const Vector3d position = result.value.position_m(target);
        misclosure.head(rows) += conditions->rows[k] * (position - reference.position_m(target));
        jacobian.topRows(rows) +=
            internal::core::product(conditions->rows[k], similarity_jacobian(defect, position));
        if (conditions->outline_rows[k].rows() > 0)
          misclosure.head(rows) += conditions->outline_rows[k] *
                                   rotation_between(*reference.points[target.point].outline,
                                                    *result.value.points[target.point].outline);
      }
      if (!conditions->distance.empty()) {
        const Vector3d from = result.value.position_m(conditions->distance[0]);
        const Vector3d to = result.value.position_m(conditions->distance[1]);
        const double length = (reference.position_m(conditions->distance[1]) -
                               reference.position_m(conditions->distance[0]))
                                  .norm();
        if (!(length > 0) || !(to != from)) return fail("the datum's two targets coincide");
        misclosure[defect.total() - 1] = (to - from).norm() - length;
        jacobian.bottomRows<1>() =
            (to - from).normalized().transpose() *
            (similarity_jacobian(defect, to) - similarity_jacobian(defect, from));
      }
      Eigen::VectorXd amount = -internal::core::minimum_norm_solution(jacobian, misclosure);
      if (!amount.allFinite()) return fail("the datum's targets do not determine it");
      // The exponential of a scale's linear step overshoots.
      constexpr double max_log_scale = 1;
      const double log_scale = std::abs(defect.directions.row(6).dot(amount));
      if (log_scale > max_log_scale) amount *= max_log_scale / log_scale;
      result.value =
          transformed_keeping_lengths(std::move(result.value), similarity_of(defect, amount));
      if (amount.norm() < 1e-14) break;
    }
  }
  observations.swap(result.value.observations);
  return result;
}

}  // namespace occ
