// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/lamp_image.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/scene/internal/lamp_emission.hpp"

namespace occ {
namespace {

constexpr std::size_t nodes = 5;
using Weights = std::array<double, nodes>;

// Lagrange weights of the nodes 0 ... 4 at t.
Weights lagrange(double t) {
  return {(t - 1) * (t - 2) * (t - 3) * (t - 4) / 24, -t * (t - 2) * (t - 3) * (t - 4) / 6,
          t * (t - 1) * (t - 3) * (t - 4) / 4, -t * (t - 1) * (t - 2) * (t - 4) / 6,
          t * (t - 1) * (t - 2) * (t - 3) / 24};
}

std::vector<Weights> lagrange_line(int count) {
  std::vector<Weights> line(static_cast<std::size_t>(count));
  const double step = (nodes - 1.0) / std::max(1, count - 1);
  for (std::size_t i = 0; i < line.size(); ++i) line[i] = lagrange(static_cast<double>(i) * step);
  return line;
}

// Irradiance over a lamp's image, with one more pixel on each side.
class Light {
 public:
  Light(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera, const Sensor& sensor,
        const Patch& patch)
      : width_(patch.width + 2), height_(patch.height + 2) {
    const double right = (width_ - 1) / (nodes - 1.0), down = (height_ - 1) / (nodes - 1.0);
    std::array<Weights, nodes> at;
    bool complete = true;
    const LampIrradiance irradiance(lamp, cam_from_world, camera, sensor);
    for (std::size_t j = 0; j < nodes; ++j)
      for (std::size_t i = 0; i < nodes; ++i) {
        const Eigen::Vector2d px(patch.x0 - 1 + right * static_cast<double>(i),
                                 patch.y0 - 1 + down * static_cast<double>(j));
        at[j][i] = irradiance.at(px);
        complete = complete && at[j][i] > 0;
      }
    values_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    // A measured emission varies on the scale of the angles of its table.
    constexpr double max_node_distance_rad = 0.02;
    const double focal_px = std::min(camera.fx_px(), camera.fy_px());
    const bool smooth =
        !lamp.photometry || std::max(right, down) <= max_node_distance_rad * focal_px;
    if (complete && smooth)
      interpolate(at);
    else
      evaluate(lamp, cam_from_world, camera, irradiance, patch);
  }

  // Irradiance at pixel (x, y) of the patch; its neighbours are at +-1 and +-width().
  const double* at(int x, int y) const { return &values_[(y + 1) * width_ + x + 1]; }
  int width() const { return width_; }

 private:
  void interpolate(const std::array<Weights, nodes>& at) {
    const std::vector<Weights> across = lagrange_line(width_), down = lagrange_line(height_);
    double* out = values_.data();
    for (const Weights& v : down) {
      Weights line{};
      for (std::size_t j = 0; j < nodes; ++j)
        for (std::size_t i = 0; i < nodes; ++i) line[i] += v[j] * at[j][i];
      for (const Weights& u : across)
        *out++ = u[0] * line[0] + u[1] * line[1] + u[2] * line[2] + u[3] * line[3] + u[4] * line[4];
    }
  }

  // Without interpolation, for patches with nodes that do not see the lit side. Such pixels receive
  // the irradiance at the lamp's centre.
  void evaluate(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                const LampIrradiance& irradiance, const Patch& patch) {
    const auto centre = camera.project(cam_from_world * lamp.centre_m);
    const double there = centre ? irradiance.at(*centre) : 0;
    double* out = values_.data();
    for (int y = -1; y <= patch.height; ++y)
      for (int x = -1; x <= patch.width; ++x) {
        const Eigen::Vector2d px(patch.x0 + x, patch.y0 + y);
        const double here = irradiance.at(px);
        *out++ = here > 0 ? here : there;
      }
  }

  int width_, height_;
  std::vector<double> values_;
};

void apply_light(const Light& light, double electrons_per_irradiance, double psf_sigma_px,
                 LampImage& image) {
  const CoverageMoments& cover = image.coverage.moments;
  const double half_variance = 0.5 * (psf_sigma_px * psf_sigma_px + 1.0 / 12);
  image.full.resize(cover.c.values.size());
  image.electrons.resize(cover.c.values.size());
  std::size_t i = 0;
  for (int y = 0; y < cover.c.height; ++y)
    for (int x = 0; x < cover.c.width; ++x, ++i) {
      const double* e = light.at(x, y);
      const double left = e[-1], right = e[1], up = e[-light.width()], down = e[light.width()];
      const double blurred = *e + half_variance * (left + right + up + down - 4 * *e);
      image.full[i] = electrons_per_irradiance * blurred;
      image.electrons[i] =
          image.full[i] * cover.c.values[i] +
          electrons_per_irradiance * 0.5 *
              ((right - left) * cover.m_x.values[i] + (down - up) * cover.m_y.values[i]);
    }
}

// Radiance is proportional to intensity over cosine of the emission angle, cos^(m-1) for a
// Lambertian lamp. At a given pixel, only a rotation of the lamp changes the direction of emission:
// a rotation w of the lamp is the rotation -w of the direction.
Vector6 radiance_change(const Lamp& lamp, const Rigid3& cam_from_world) {
  const Eigen::Vector3d ray = (cam_from_world * lamp.centre_m).normalized();
  const Eigen::Vector3d normal = cam_from_world.rotation * lamp.normal;
  Vector6 change = Vector6::Zero();
  if (lamp.photometry) {
    const internal::scene::LampEmission emission(lamp, cam_from_world.rotation);
    change.head<3>() =
        -emission.log_gradient(-ray).cross(ray) - normal.cross(ray) / ray.dot(normal);
    return change;
  }
  change.head<3>() = (lamp.order() - 1) * normal.cross(ray) / ray.dot(normal);
  return change;
}

bool render_extended(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                     const Sensor& sensor, const PixelPsf& psf, double spacing_px,
                     LampImage& image) {
  const auto contour = project_moving_contour(lamp, cam_from_world, camera, spacing_px);
  if (!contour) return false;
  coverage_derivatives(*contour, psf, camera.width(), camera.height(), image.coverage);
  const Patch& c = image.coverage.moments.c;
  image.full.clear();
  image.electrons.clear();
  if (c.width == 0) return true;
  const Light light(lamp, cam_from_world, camera, sensor, c);
  apply_light(light, sensor.electrons(1) - sensor.electrons(0), psf.sigma_px(), image);
  image.d_log_light = radiance_change(lamp, cam_from_world);
  return true;
}

// Computes d (PSF at a pixel) / d (position, ln sigma).
void differentiate_point(const Eigen::Vector2d& px, const Eigen::Matrix<double, 2, 3>& d_px,
                         const PixelPsf& psf, LampImage& image) {
  const Patch& c = image.coverage.moments.c;
  const auto count = static_cast<std::size_t>(psf.count());
  std::array<std::vector<double>, 2> weights, slopes, curvatures;
  std::array<int, 2> first{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double at = px[static_cast<Eigen::Index>(axis)], below = std::floor(at);
    for (auto* table : {&weights, &slopes, &curvatures}) (*table)[axis].resize(count);
    psf.weights(at - below, weights[axis].data());
    psf.slopes(at - below, slopes[axis].data());
    psf.curvatures(at - below, curvatures[axis].data());
    first[axis] = static_cast<int>(below) - psf.reach();
  }
  const double variance = psf.sigma_px() * psf.sigma_px();
  image.coverage.d.assign(c.values.size(), {});
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      const auto i = static_cast<std::size_t>(c.x0 + x - first[0]);
      const auto j = static_cast<std::size_t>(c.y0 + y - first[1]);
      const Eigen::Vector3d by_shift = -slopes[0][i] * weights[1][j] * d_px.row(0).transpose() -
                                       weights[0][i] * slopes[1][j] * d_px.row(1).transpose();
      const double spread =
          variance * (curvatures[0][i] * weights[1][j] + weights[0][i] * curvatures[1][j]);
      CoverageDerivatives::Row& d = image.coverage.d[y * c.width + x];
      for (std::size_t k = 0; k < 3; ++k)
        d[3 + k] = static_cast<float>(by_shift[static_cast<Eigen::Index>(k)]);
      d[6] = static_cast<float>(spread);
    }
}

bool render_point(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                  const Sensor& sensor, const PixelPsf& psf, LampImage& image) {
  Eigen::Matrix<double, 2, 3> d_px;
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  const auto px = camera.project(centre, &d_px);
  Eigen::Matrix<double, 1, 6> d_log;
  const double electrons = lamp_electrons(lamp, cam_from_world, camera, sensor, &d_log);
  if (!px || !(electrons > 0)) return false;
  CoverageMoments& moments = image.coverage.moments;
  moments.c = point_coverage(*px, psf, camera.width(), camera.height());
  moments.m_x = moments.m_y = Patch{};
  image.electrons = moments.c.values;
  for (double& value : image.electrons) value *= electrons;
  image.full.assign(moments.c.values.size(), electrons);
  // Converts the rotation about the camera's centre to a rotation about the lamp's centre.
  image.d_log_light = d_log.transpose();
  image.d_log_light.head<3>() -= centre.cross(image.d_log_light.tail<3>());
  differentiate_point(*px, d_px, psf, image);
  return true;
}

}  // namespace

bool render_lamp(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                 const Sensor& sensor, const PixelPsf& psf, double spacing_px, LampImage& image) {
  return lamp.shape == LampShape::point
             ? render_point(lamp, cam_from_world, camera, sensor, psf, image)
             : render_extended(lamp, cam_from_world, camera, sensor, psf, spacing_px, image);
}

}  // namespace occ
