// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/adjustment_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <tuple>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/name_list.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/internal/network_checks.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Vector3d;

std::string number(double value, int digits = 3) {
  std::ostringstream text;
  text << std::setprecision(digits) << value;
  return text.str();
}

/// Used image points of each station, point and body.
struct UsedCounts {
  std::vector<int> of_station, of_point, of_body;

  explicit UsedCounts(const Network& network)
      : of_station(network.stations.size()),
        of_point(network.points.size()),
        of_body(network.bodies.size()) {
    for (const ImageObservation& observation : network.observations) {
      if (!observation.used) continue;
      ++of_station[network.images[observation.image].station];
      ++(observation.target.body < 0 ? of_point[observation.target.point]
                                     : of_body[observation.target.body]);
    }
  }
};

class Report {
 public:
  Report(const Network& given, const NetworkLayout& layout, const LeftOutReasons& reasons,
         Adjustment& out)
      : given_(given),
        layout_(layout),
        reasons_(reasons),
        out_(out),
        before_(given),
        after_(out.network) {}

  void list_left_out() {
    for (std::size_t i = 0; i < given_.stations.size(); ++i) {
      // A station without any observation is an image that the caller has not measured.
      const bool is_used = given_.stations[i].fixed || layout_.stations[i] != none;
      if (before_.of_station[i] == 0 || is_used) continue;
      leave_out(LeftOut::Kind::station, i, name_or(given_.stations[i], "station", i),
                after_.of_station[i] == 0 ? "keeps no image point"
                                          : "observes no target that others observe too");
      out_.network.stations[i].station_from_world = given_.stations[i].station_from_world;
    }
    for (std::size_t i = 0; i < given_.points.size(); ++i) {
      if (before_.of_point[i] == 0 || layout_.determined_point[i]) continue;
      leave_out(LeftOut::Kind::point, i, given_.name_of(Target::of_point(static_cast<int>(i))),
                after_.of_point[i] == 0    ? "keeps no image point"
                : before_.of_point[i] == 1 ? "is observed in one image only"
                                           : "is observed in one image only; others were rejected");
      out_.network.points[i].position_m = given_.points[i].position_m;
    }
    for (std::size_t i = 0; i < given_.bodies.size(); ++i) {
      if (before_.of_body[i] == 0 || layout_.determined_body[i]) continue;
      leave_out(LeftOut::Kind::body, i, name_or(given_.bodies[i], "body", i),
                "has too few observed corners");
      out_.network.bodies[i].world_from_body = given_.bodies[i].world_from_body;
      out_.network.bodies[i].scale = given_.bodies[i].scale;
    }
    for (std::size_t i = 0; i < given_.distances.size(); ++i) {
      const DistanceObservation& distance = out_.network.distances[i];
      const bool is_determined =
          layout_.is_determined(distance.from) && layout_.is_determined(distance.to);
      if (distance.used && !is_determined)
        leave_out(LeftOut::Kind::distance, i, name_of_distance(given_, static_cast<int>(i)),
                  "ends at a target that is left out");
    }
    for (std::size_t i = 0; i < given_.control.size(); ++i)
      if (out_.network.control[i].used && !layout_.is_determined(out_.network.control[i].target))
        leave_out(LeftOut::Kind::control, i, name_of_control(given_, static_cast<int>(i)),
                  "is a target that is left out");
    warn_of_left_out();
  }

  /// One warning for each kind and reason.
  void warn_of_left_out() {
    std::vector<std::pair<LeftOut, std::vector<std::string>>> groups;  // with further names
    for (const LeftOut& one : out_.left_out) {
      const auto alike = std::find_if(groups.begin(), groups.end(), [&](const auto& group) {
        return group.first.kind == one.kind && group.first.reason == one.reason;
      });
      if (alike == groups.end())
        groups.push_back({one, {}});
      else
        alike->second.push_back(one.name);
    }
    for (const auto& [first, others] : groups)
      out_.warnings.push_back(first.name + " is left out: it " + first.reason +
                              (others.empty()       ? ""
                               : others.size() == 1 ? "; so is "
                                                    : "; so are ") +
                              core::name_list(others, others.size()));
  }

  void warn_of_datum() {
    for (RejectedDistance& one : out_.rejected_distances) {
      const DistanceObservation& distance = out_.network.distances[one.distance];
      one.residual_m =
          distance.length_m -
          (out_.network.position_m(distance.to) - out_.network.position_m(distance.from)).norm();
      out_.warnings.push_back(one.name + " is rejected: it differs from the others by " +
                              number(1e3 * one.residual_m) + " mm, " + number(one.normalised) +
                              " of its sigmas");
    }
    for (RejectedControl& one : out_.rejected_control) {
      static const char* const names[] = {"x", "y", "z"};
      const ControlPoint& control = out_.network.control[one.control];
      one.residual_m =
          (control.position_m - out_.network.position_m(control.target))[one.coordinate];
      out_.warnings.push_back(one.name + " is rejected: its " + names[one.coordinate] +
                              " differs from the others by " + number(1e3 * one.residual_m) +
                              " mm, " + number(one.normalised) + " of its sigmas");
    }
    const int before = datum_defect(given_).total();
    if (out_.defect > before)
      out_.warnings.push_back("the datum defect is " + std::to_string(out_.defect) +
                              " instead of " + std::to_string(before) +
                              ", because observations that define the datum were rejected or left "
                              "out");
  }

  void warn_of_rays() {
    std::vector<char> is_controlled(given_.points.size());
    for (const ControlPoint& control : out_.network.control)
      if (control.used && control.target.body < 0) is_controlled[control.target.point] = 1;
    for (std::size_t i = 0; i < given_.points.size(); ++i)
      if (layout_.points[i] != none && !is_controlled[i] &&
          after_.of_point[i] < before_.of_point[i] &&
          (after_.of_point[i] == 2 || 2 * after_.of_point[i] <= before_.of_point[i])) {
        out_.weak_points.push_back(static_cast<int>(i));
        out_.warnings.push_back(
            given_.name_of(Target::of_point(static_cast<int>(i))) + " keeps " +
            std::to_string(after_.of_point[i]) + " rays of " + std::to_string(before_.of_point[i]) +
            (after_.of_point[i] == 2 ? ": an error along the rays' plane is not detected"
                                     : ": they may agree by chance"));
      }
    std::vector<std::string> with_three;
    for (std::size_t i = 0; i < given_.stations.size(); ++i) {
      if (layout_.stations[i] == none) continue;
      const std::string name = name_or(given_.stations[i], "station", i);
      const int before = before_.of_station[i], after = after_.of_station[i];
      if (after == 3)
        with_three.push_back(name);
      else if (2 * after <= before)
        out_.warnings.push_back(name + " keeps " + std::to_string(after) + " of " +
                                std::to_string(before) +
                                " image points: its camera, its targets or its zoom may be others");
    }
    constexpr std::size_t max_names = 8;
    if (!with_three.empty())
      out_.warnings.push_back(
          "three image points have no redundancy: their errors are not detected, and another pose "
          "may fit them as well: " +
          core::name_list(with_three, max_names));
    if (out_.redundancy == 0) out_.warnings.push_back("the redundancy is 0: no error is detected");
  }

  /// Names targets that occur twice in an image: one of the two is another target. Whole periods of
  /// a panorama apart, it is the same one.
  void warn_of_duplicates() {
    std::map<std::tuple<int, int, int, int>, int> seen;
    for (std::size_t i = 0; i < given_.observations.size(); ++i) {
      const ImageObservation& one = given_.observations[i];
      const auto [first, is_new] = seen.insert({{one.image, one.target.point, one.target.body,
                                                 one.target.body < 0 ? 0 : one.target.corner},
                                                static_cast<int>(i)});
      if (is_new) continue;
      const NetworkImage& image = given_.images[one.image];
      const double period = given_.cameras[image.camera].camera.period_px();
      const double apart = std::abs(given_.observations[first->second].pixel.x() - one.pixel.x());
      if (std::isfinite(period) && apart > 0.5 * period) continue;
      out_.warnings.push_back(name_or(image, "image", static_cast<std::size_t>(one.image)) +
                              " observes " + given_.name_of(one.target) + " twice, at columns " +
                              number(given_.observations[first->second].pixel.x()) + " and " +
                              number(one.pixel.x()) + "; one of them may be another target");
    }
  }

  void warn_of_priors() {
    constexpr double gate_sigma = 4;  // a false alarm in 30 000 priors
    for (const PosePrior& prior : given_.pose_priors) {
      const Vector6 residual = difference(out_.network.stations[prior.station].station_from_world,
                                          prior.station_from_world);
      const Eigen::MatrixXd covariance = prior.covariance;
      const double chi2 = residual.dot(core::solve_ldlt(prior.covariance, residual));
      if (chi2 > gate_chi2(gate_sigma, 6))
        out_.warnings.push_back("the pose prior of " +
                                name_or(given_.stations[prior.station], "station",
                                        static_cast<std::size_t>(prior.station)) +
                                " contradicts the images: chi-squared " + number(chi2) + " of 6");
    }
    for (const ParameterPrior& prior : given_.parameter_priors)
      for (const CameraParameter& parameter :
           out_.network.cameras[prior.camera].camera.parameters()) {
        const double w = (parameter.value - prior.value) / prior.sigma;
        if (parameter.name == prior.parameter && std::abs(w) > gate_sigma)
          out_.warnings.push_back("the prior of " + prior.parameter + " of " +
                                  name_or(given_.cameras[prior.camera], "camera",
                                          static_cast<std::size_t>(prior.camera)) +
                                  " contradicts the images by " + number(std::abs(w)) +
                                  " of its sigmas");
      }
  }

  /// Stations at one place determine no distances, stations on a line leave a rotation weak.
  void warn_of_geometry() {
    // Half of the distances' relative errors come from an angle of this size between the rays.
    constexpr double min_base = 0.01, min_width = 0.01;
    std::vector<Vector3d> centres, points;
    for (std::size_t i = 0; i < given_.stations.size(); ++i)
      if (after_.of_station[i] > 0)
        centres.push_back(out_.network.stations[i].station_from_world.origin_in_source());
    for (std::size_t i = 0; i < given_.points.size(); ++i)
      if (after_.of_point[i] > 0 && layout_.determined_point[i])
        points.push_back(out_.network.points[i].position_m);
    for (std::size_t i = 0; i < given_.bodies.size(); ++i)
      if (after_.of_body[i] > 0 && layout_.determined_body[i])
        points.push_back(out_.network.bodies[i].world_from_body.translation);
    if (centres.size() < 2 || points.empty()) return;
    Vector3d middle = Vector3d::Zero();
    for (const Vector3d& centre : centres) middle += centre / static_cast<double>(centres.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Vector3d& centre : centres)
      scatter +=
          (centre - middle) * (centre - middle).transpose() / static_cast<double>(centres.size());
    const auto eigen = core::symmetric_eigen<Eigen::Matrix3d>(scatter);
    const double along = std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
    const double across = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
    std::vector<double> distances;
    for (const Vector3d& point : points) distances.push_back((point - middle).norm());
    const double distance = median(std::move(distances));
    if (!(distance > 0)) return;
    if (along < min_base * distance) {
      out_.warnings.push_back("all images were taken from one place (within " + number(along) +
                              " m; the targets are " + number(distance) +
                              " m away): their distances are hardly determined");
    } else if (centres.size() > 2 && across < min_width * along) {
      out_.warnings.push_back(
          "all images were taken from one line (" + number(along) + " m long, " + number(across) +
          " m wide): what depends on their height above it is hardly determined");
    }
  }

  /// Share of the image points that were rejected, and a sentence that counts all rejections; empty
  /// without any.
  std::string count_rejected() {
    std::size_t given = 0;
    for (const ImageObservation& observation : given_.observations) given += observation.used;
    if (given > 0)
      out_.rejected_share = static_cast<double>(out_.rejected.size()) / static_cast<double>(given);
    std::string text;
    const auto add = [&](std::size_t rejected, std::size_t all, const std::string& what) {
      if (rejected == 0) return;
      text += (text.empty() ? "" : ", ") + std::to_string(rejected) + " of " + std::to_string(all) +
              " " + what;
    };
    add(out_.rejected.size(), given, "image points (" + number(100 * out_.rejected_share) + " %)");
    add(out_.rejected_distances.size(), given_.distances.size(), "distances");
    add(out_.rejected_control.size(), given_.control.size(), "control points");
    return text.empty() ? text : text + " rejected";
  }

 private:
  void leave_out(LeftOut::Kind kind, std::size_t index, const std::string& name,
                 const std::string& reason) {
    const auto known = reasons_.find({kind, static_cast<int>(index)});
    out_.left_out.push_back(
        {kind, static_cast<int>(index), name, known == reasons_.end() ? reason : known->second});
  }

  const Network& given_;
  const NetworkLayout& layout_;
  const LeftOutReasons& reasons_;
  Adjustment& out_;
  UsedCounts before_, after_;
};

}  // namespace

std::string name_of_distance(const Network& network, int distance) {
  const DistanceObservation& one = network.distances[distance];
  return "distance " + std::to_string(distance) + " (" + network.name_of(one.from) + " to " +
         network.name_of(one.to) + ", " + number(one.length_m, 6) + " m)";
}

std::string name_of_control(const Network& network, int control) {
  return "control point " + std::to_string(control) + " (" +
         network.name_of(network.control[control].target) + ")";
}

std::string contradiction_of(const std::vector<std::string>& names) {
  constexpr std::size_t max_names = 8;
  if (names.size() == 1) return names[0] + " contradicts the size of the network; check both";
  if (names.size() == 2)
    return names[0] + " and " + names[1] +
           " contradict each other, and either may be wrong; check both";
  return core::name_list(names, max_names) +
         " contradict each other, and each may be wrong; check all";
}

void report(const Network& given, const NetworkLayout& layout, const LeftOutReasons& reasons,
            const std::string& contradiction, Result<Adjustment>& result) {
  // The highest share at which each point still has a majority of right rays in most networks; the
  // median of squares breaks down at one half (Rousseeuw, "Least median of squares regression",
  // JASA 79, 1984).
  constexpr double max_share = 0.4;
  Adjustment& out = result.value;
  if (layout.stations.size() != given.stations.size()) return;  // nothing was adjusted
  Report one(given, layout, reasons, out);
  one.list_left_out();
  one.warn_of_datum();
  one.warn_of_rays();
  one.warn_of_duplicates();
  const std::string rejected = one.count_rejected();
  if (!contradiction.empty()) out.warnings.push_back(contradiction);
  if (!result.ok()) {
    for (const LeftOut& left : out.left_out)
      if (left.kind == LeftOut::Kind::station && result.status == Status::too_few_lamps)
        result.message += "; " + left.name + " " + left.reason;
    return;
  }
  one.warn_of_priors();
  one.warn_of_geometry();
  result.message = rejected;
  if (!contradiction.empty()) {
    result.status = Status::ambiguous;
    result.message = contradiction;
  } else if (out.rejected_share > max_share) {
    result.status = Status::ambiguous;
    result.message = rejected + ": the rest may agree by chance; check the names of the targets";
  }
}

}  // namespace occ::internal::network
