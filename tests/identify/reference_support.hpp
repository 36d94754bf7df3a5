// SPDX-License-Identifier: Apache-2.0
// Diverse rooms of lamps, the blobs that a detector would measure in them, and the results of
// identify() as numbers. Reference tests of locate and track use the rooms as well: a change of
// them changes those files, too.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/identify/identify.hpp"
#include "tests/identify/identify_support.hpp"
#include "tests/support/references.hpp"
#include "tests/support/rim_support.hpp"

namespace occ::test {

/// Properties of a blob besides its place.
struct Look {
  double sigma_px = 0.1;
  double flux_sigma = 0.05;  ///< relative; 0: the flux is unknown
  double unknown_flux = 0;   ///< share of the lamps
  double gain = 1;           ///< common factor of all fluxes
  bool sized = false;        ///< rims, ellipses and corners
  double size_error = 0.02;  ///< relative
  double saturated = 0, cut = 0, merged = 0, striped = 0, dark = 0;  ///< shares of the lamps
  bool coloured = false;
  double read_frequencies = 0, read_ids = 0;  ///< shares of the lamps
};

/// Sets the ellipse from the second moments of the rim, whose points are equidistant in angle.
inline void set_ellipse(Blob& blob, const std::vector<Eigen::Vector2d>& rim, double growth) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& px : rim) mean += px / static_cast<double>(rim.size());
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& px : rim)
    moment += 2 / static_cast<double>(rim.size()) * (px - mean) * (px - mean).transpose();
  const double middle = 0.5 * moment.trace();
  const double difference = 0.5 * (moment(0, 0) - moment(1, 1));
  const double apart = std::hypot(difference, moment(0, 1));
  blob.ellipse.centre_px = mean;
  blob.ellipse.semi_major_px = growth * std::sqrt(middle + apart);
  blob.ellipse.semi_minor_px = growth * std::sqrt(std::max(middle - apart, 0.0));
  blob.ellipse.angle_rad = 0.5 * std::atan2(moment(0, 1), difference);
  blob.area_px = static_cast<int>(pi * blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px + 1);
  Eigen::Vector2d low = rim.front(), high = rim.front();
  for (const Eigen::Vector2d& px : rim) low = low.cwiseMin(px), high = high.cwiseMax(px);
  blob.x0 = static_cast<int>(low.x()), blob.y0 = static_cast<int>(low.y());
  blob.x1 = static_cast<int>(high.x()) + 1, blob.y1 = static_cast<int>(high.y()) + 1;
}

/// Sets rim, ellipse and corners of a lamp's blob.
inline void set_size(Blob& blob, const Lamp& lamp, const Scene& scene, const Rigid3& pose,
                     const Look& look, Random& random) {
  const double growth = 1 + look.size_error * random.normal();
  const auto rim = project_rim(lamp, pose, scene.camera, 64);
  if (lamp.shape == LampShape::point || !rim) return;
  set_ellipse(blob, *rim, growth);
  if (blob.ellipse.semi_minor_px < 1) return;
  blob.rim = exact_rim(lamp, pose, scene.camera, 8, 0.05);
  if (lamp.shape != LampShape::rectangle || look.size_error > 0.1) return;
  const Eigen::Vector3d a = 0.5 * lamp.size_m.x() * lamp.x_axis;
  const Eigen::Vector3d b = 0.5 * lamp.size_m.y() * lamp.normal.cross(lamp.x_axis);
  for (const Eigen::Vector3d& corner : {Eigen::Vector3d(a + b), Eigen::Vector3d(a - b),
                                        Eigen::Vector3d(-a - b), Eigen::Vector3d(-a + b)})
    if (const auto px = scene.camera.project(pose * (lamp.centre_m + corner)))
      blob.corners_px.push_back(*px + 0.5 * look.sigma_px *
                                          Eigen::Vector2d(random.normal(), random.normal()));
}

inline void set_state(Blob& blob, const Look& look, Random& random) {
  const double state = random.uniform();
  double share = look.saturated;
  if (state < share) {
    blob.saturated = true;
    return;
  }
  share += look.cut;
  if (state < share) {
    blob.cut_by_border = true;
    if (state > share - 0.5 * look.cut) blob.area_px /= 2;
    return;
  }
  share += look.merged;
  if (state < share) {
    blob.merged = true;
    return;
  }
  blob.striped = state < share + look.striped;
}

/// The image of a lamp; nothing if it is dark or out of view.
inline void add_lamp(View& view, const Scene& scene, int index, const Look& look, Random& random) {
  const Lamp& lamp = scene.lamps[static_cast<std::size_t>(index)];
  const Rigid3& pose = view.cam_from_world;
  const auto px = project_lamp_centre(lamp, pose, scene.camera);
  const double electrons = lamp_electrons(lamp, pose, scene.camera, scene.sensor);
  if (!px || !scene.camera.contains(*px) || !(electrons > 0) || random.uniform() < look.dark)
    return;
  const Eigen::Vector2d noise(random.normal(), random.normal());
  const double error = std::hypot(look.flux_sigma, lamp.power_sigma);
  Blob blob = spot(*px + look.sigma_px * noise, look.sigma_px,
                   look.gain * electrons * std::exp(error * random.normal()));
  blob.flux_sigma_dn = look.flux_sigma * blob.flux_dn;
  if (look.unknown_flux > 0 && random.uniform() < look.unknown_flux) blob.flux_sigma_dn = 0;
  blob.area_px = 20;
  if (look.sized) set_size(blob, lamp, scene, pose, look, random);
  set_state(blob, look, random);
  if (look.coloured)
    blob.colour = BlobColour{lamp.colour / lamp.colour.sum(), Eigen::Vector3d::Constant(0.02), {}};
  if (lamp.frequency_hz && random.uniform() < look.read_frequencies) {
    blob.frequency_hz = *lamp.frequency_hz * (1 + 0.005 * random.normal());
    blob.frequency_sigma_hz = 5;
  }
  if (random.uniform() < look.read_ids) blob.lamp_id = lamp.id;
  view.blobs.push_back(blob);
  view.lamp.push_back(index);
}

inline View look_at_lamps(const Scene& scene, const Rigid3& pose, const Look& look, Random& random,
                          int false_lights = 0) {
  View view{pose, {}, {}};
  for (int i = 0; i < static_cast<int>(scene.lamps.size()); ++i)
    add_lamp(view, scene, i, look, random);
  add_false_lights(view, scene, random, false_lights);
  for (std::size_t i = 0; look.coloured && i < view.blobs.size(); ++i) {
    if (view.lamp[i] >= 0 || random.uniform() < 0.3) continue;
    const Eigen::Vector3d colour(1, random.uniform(0.1, 1), random.uniform(0.1, 1));
    view.blobs[i].colour = BlobColour{colour / colour.sum(), Eigen::Vector3d::Constant(0.02), {}};
  }
  shuffle(view, random);
  return view;
}

/// A room whose lamps differ in shape, size, tilt, power and colour.
inline Scene varied_room(Random& random, int count, int style) {
  Scene scene = random_room(random, count, style % 3 == 0 ? 3 : 2.3);
  for (Lamp& lamp : scene.lamps) {
    const int kind = style % 2 == 0 ? 0 : random.below(4);
    if (kind == 1) {
      lamp.shape = LampShape::rectangle;
      lamp.size_m = {random.uniform(0.15, 0.5), random.uniform(0.1, 0.3)};
    } else if (kind == 2) {
      lamp.shape = LampShape::point;
      lamp.radius_m = 0;
    } else {
      lamp.radius_m = style % 5 == 0 ? 0.085 : random.uniform(0.03, 0.2);
    }
    if (style % 4 == 1)
      lamp.normal = (Eigen::Vector3d(0, 0, -1) + 0.3 * random_vector(random)).normalized();
    lamp.power_w = style % 5 < 2 ? 1.5 : std::exp(random.uniform(-1, 1.5));
    lamp.power_sigma = style % 5 == 3 ? 0.3 : 0.1;
    lamp.half_power_rad = style % 7 == 2 ? 0.6 : 1.0471975511965976;
    lamp.colour = style % 6 == 4 && lamp.id % 2 ? Eigen::Vector3d(1, 0.2, 0.1)
                                                : Eigen::Vector3d(0.5, 0.9, 0.8);
    if (style % 6 >= 4 && lamp.id % 3) lamp.frequency_hz = 900 + 150 * (lamp.id % 5);
  }
  if (style % 8 == 7) scene.boxes.push_back({{1.5, 1.5, 1.8}, {1.9, 2.3, 2.2}});
  if (style % 9 == 5) scene.map_sigma_m = Eigen::Vector3d(0.01, 0.02, 0.03);
  scene.validate();
  return scene;
}

inline void append(std::vector<double>& numbers, const Rigid3& pose) {
  for (const double value : pose.rotation.reshaped()) numbers.push_back(value);
  for (const double value : pose.translation) numbers.push_back(value);
}

/// The first hypotheses. Numbers of one magnitude are summarised together. Probabilities are
/// compared by their logarithms.
inline void add_hypotheses(CaseResults& results, const std::string& label,
                           const std::vector<Hypothesis>& hypotheses) {
  constexpr std::size_t max_listed = 6;
  std::vector<double> poses, chi2, matches, symmetries;
  for (std::size_t i = 0; i < std::min(max_listed, hypotheses.size()); ++i) {
    const Hypothesis& h = hypotheses[i];
    append(poses, h.cam_from_world);
    for (const double value : {h.chi2, h.brightness_chi2}) chi2.push_back(value);
    chi2.push_back(std::log(std::max(h.probability, 1e-100)));
    matches.push_back(h.missed);
    for (const Match& m : h.matches) matches.push_back(m.lamp + 0.01 * m.blob);
    if (!h.symmetry) continue;
    symmetries.push_back(static_cast<double>(h.symmetry->kind));
    symmetries.push_back(h.symmetry->misfit_m);
    append(symmetries, h.symmetry->world_from_world);
  }
  results.summarise(label, poses);
  if (hypotheses.empty()) return;
  results.summarise("chi2", chi2);
  results.summarise("matches", matches);
  if (!symmetries.empty()) results.summarise("symmetries", symmetries);
}

inline std::string joined(const std::string& text) {
  std::string word = text;
  std::replace(word.begin(), word.end(), ' ', '_');
  return word;
}

/// Results of identify().
inline CaseResults results_of(const Result<Identification>& found) {
  CaseResults results;
  results.add("status", static_cast<double>(found.status));
  results.add("log_risk", std::log(std::max(found->risk, 1e-100)));
  results.add("tried", found->tried);
  results.add("log_chance", std::log(std::max(found->chance, 1e-100)));
  results.add("untried", found->untried);
  add_hypotheses(results, "poses", found->hypotheses);
  results.add("count", static_cast<double>(found->hypotheses.size()));
  if (found->excluded_listed) add_hypotheses(results, "excluded", found->excluded);
  if (!found.message.empty()) results.add("message", joined(found.message));
  return results;
}

inline bool is_valid(const Prior& prior) {
  return complaint([&] { prior.validate(); }).empty();
}

/// A prior with the chosen parts, off by `off` sigmas; without parts that contradict others.
inline Prior prior_of(const Rigid3& pose, int parts, double off, Random& random) {
  Prior prior;
  const auto noise = [&] { return off * random.normal(); };
  const Eigen::Vector3d eye = pose.origin_in_source();
  if (parts & 1) {
    prior.position_sigma_m = 0.3;
    prior.position_m = eye + 0.3 * Eigen::Vector3d(noise(), noise(), noise());
  }
  if (parts & 2) prior.height_m = eye.z() + prior.height_sigma_m * noise();
  if (parts & 4) prior.heading_rad = heading_rad(pose) + prior.heading_sigma_rad * noise();
  if (parts & 8)
    prior.gravity_in_cam = so3_exp(0.02 * Eigen::Vector3d(noise(), noise(), noise())) *
                           (pose.rotation * -Eigen::Vector3d::UnitZ());
  if (parts & 16) {
    Vector6 delta;
    for (int i = 0; i < 6; ++i) delta[i] = (i < 3 ? 0.03 : 0.1) * noise();
    Matrix6 covariance = Matrix6::Identity();
    for (int i = 0; i < 6; ++i) covariance(i, i) = square(i < 3 ? 0.03 : 0.1);
    prior.last_pose =
        PriorPose{Rigid3{so3_exp(delta.head<3>()) * pose.rotation,
                         so3_exp(delta.head<3>()) * pose.translation + delta.tail<3>()},
                  covariance};
  }
  if (!is_valid(prior)) prior.last_pose.reset();
  if (!is_valid(prior)) prior.position_m.reset();
  return prior;
}

}  // namespace occ::test
