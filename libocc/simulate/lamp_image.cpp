// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/lamp_image.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/sharp_coverage.hpp"
#include "libocc/simulate/internal/irradiance_field.hpp"

namespace occ {
namespace {

struct LitRow {
  const double *light, *above, *below;  // one pixel before the first
  const double *m_x, *m_y;
  double electrons, half_variance;
  int count;
};

/// Coverage to electrons.
template <Simd>
LIBOCC_INLINE void light_row_body(LitRow row, double* c) {
  const double* e = row.light + 1;
  for (int x = 0; x < row.count; ++x) {
    const double left = e[x - 1], right = e[x + 1], up = row.above[x + 1], down = row.below[x + 1];
    const double blurred = e[x] + row.half_variance * (left + right + up + down - 4 * e[x]);
    c[x] = row.electrons *
           (blurred * c[x] + 0.5 * (right - left) * row.m_x[x] + 0.5 * (down - up) * row.m_y[x]);
  }
}
LIBOCC_MULTIVERSION(light_row, (LitRow row, double* c), (row, c))

// All light in the pixel that it falls on.
Patch sharp_dot(const Eigen::Vector2d& px, int width, int height) {
  const double x = std::floor(px.x() + 0.5), y = std::floor(px.y() + 0.5);
  if (!(x >= 0 && x < width && y >= 0 && y < height)) return {};
  return {static_cast<int>(x), static_cast<int>(y), 1, 1, {1.0}};
}

// Sums patches, each with a factor.
class PatchSum {
 public:
  void add(Patch patch, double factor) {
    for (double& value : patch.values) value *= factor;
    if (patch.width > 0) parts_.push_back(std::move(patch));
  }

  Patch sum() const {
    if (parts_.size() <= 1) return parts_.empty() ? Patch{} : parts_.front();
    Patch all = parts_.front();
    int x1 = 0, y1 = 0;
    for (const Patch& part : parts_) {
      all.x0 = std::min(all.x0, part.x0);
      all.y0 = std::min(all.y0, part.y0);
      x1 = std::max(x1, part.x0 + part.width);
      y1 = std::max(y1, part.y0 + part.height);
    }
    all.width = x1 - all.x0;
    all.height = y1 - all.y0;
    all.values.assign(static_cast<std::size_t>(all.width) * static_cast<std::size_t>(all.height),
                      0.0);
    for (const Patch& part : parts_)
      for (int y = 0; y < part.height; ++y)
        for (int x = 0; x < part.width; ++x)
          all.values[static_cast<std::size_t>((part.y0 + y - all.y0) * all.width + part.x0 + x -
                                              all.x0)] += part.at(part.x0 + x, part.y0 + y);
    return all;
  }

 private:
  std::vector<Patch> parts_;
};

}  // namespace

LampRenderer::LampRenderer(const Frame& frame)
    : frame_(frame), camera_(rendered_camera(frame)), motion_(frame) {
  if (frame.plan.applies(Effect::vignetting)) vignetting_.emplace(frame.scene);
  if (!frame.plan.applies(Effect::psf)) return;
  psf_ = &frame.storage.psf(gaussian_blur_px(frame.scene));
  spacing_px_ = frame.options.spacing_sigma * psf_->sigma_px();
}

// A part of the exposure is at most 0.7 sigma of the blurred pixel long, or an eighth of a sharp
// one.
double LampRenderer::panels_per_px() const {
  return psf_ ? 1 / (0.7 * std::sqrt(psf_->sigma_px() * psf_->sigma_px() + 0.06)) : 8;
}

std::vector<LightNode> LampRenderer::nodes(const Lamp& lamp) const {
  if (motion_.kind(lamp) == Motion::Kind::still) return {{motion_.still_s(), 1}};
  const double path = path_px(lamp, motion_, camera_, 0, motion_.exposure_s());
  return motion_.nodes(lamp, 0, 1 + static_cast<int>(std::min(1e4, path * panels_per_px())));
}

bool LampRenderer::is_point(const Lamp& lamp) const {
  return lamp.shape == LampShape::point || !frame_.plan.applies(Effect::extent);
}

Visible LampRenderer::visible(const Lamp& lamp, const Rigid3& pose) const {
  if (!may_be_hidden()) return {};
  return visible_part(lamp, frame_.scene.boxes, pose.origin_in_source());
}

double LampRenderer::point_electrons(const Lamp& lamp, const Rigid3& pose,
                                     const Eigen::Vector2d& px) const {
  const double electrons =
      visible(lamp, pose).share * lamp_electrons(lamp, pose, camera_, frame_.scene.sensor);
  return vignetting_ ? electrons * vignetting_->transmission(px) : electrons;
}

Eigen::Vector2d LampRenderer::log_light_gradient(const Lamp& lamp, const Rigid3& pose) const {
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  const auto px = camera_.project(pose * lamp.centre_m);
  if (!px) return gradient;
  if (frame_.plan.applies(Effect::light_gradient))
    gradient = log_irradiance_gradient(lamp, pose, camera_, frame_.scene.sensor, *px);
  if (vignetting_)
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d half = 0.5 * Eigen::Vector2d::Unit(axis);
      gradient[axis] +=
          std::log(vignetting_->transmission(*px + half) / vignetting_->transmission(*px - half));
    }
  return gradient;
}

std::vector<BlurShift> LampRenderer::shifts(const Lamp& lamp, const Rigid3& pose) const {
  const double depth_m = (pose * lamp.centre_m).z();
  const double radius = psf_ ? defocus_radius_px(frame_.scene, depth_m) : 0;
  std::vector<BlurShift> shifts = disc_shifts(radius, psf_ ? psf_->sigma_px() : 1);
  if (radius == 0 || is_point(lamp)) return shifts;
  const Eigen::Vector2d gradient = log_light_gradient(lamp, pose);
  for (BlurShift& shift : shifts) shift.weight *= 1 - shift.px.dot(gradient);
  return shifts;
}

// Light from a pose over that of the reference pose's field where the lamp is then.
double LampRenderer::light_change(const Lamp& lamp, const Rigid3& reference,
                                  const Rigid3& pose) const {
  const Sensor& sensor = frame_.scene.sensor;
  const auto there = camera_.project(pose * lamp.centre_m);
  const auto here = frame_.plan.applies(Effect::light_gradient)
                        ? there
                        : camera_.project(reference * lamp.centre_m);
  if (!there || !here) return 1;
  const double now = irradiance_at(lamp, pose, camera_, sensor, *there);
  const double before = irradiance_at(lamp, reference, camera_, sensor, *here);
  return now > 0 && before > 0 ? now / before : 1;
}

// In the camera's frame at this pose.
std::optional<RimContour> LampRenderer::rim(const Lamp& lamp, const Rigid3& pose) const {
  if (!may_be_hidden()) return rim_contour(lamp, pose, camera_, spacing_px_);
  return visible_rim(lamp, visible(lamp, pose), pose, camera_, spacing_px_);
}

std::optional<Contour> LampRenderer::contour(const Lamp& lamp, const std::vector<LightNode>& nodes,
                                             const std::vector<BlurShift>& shifts) const {
  const Rigid3 reference = motion_.pose_at(nodes[nodes.size() / 2].time_s);
  if (nodes.size() == 1 && shifts.size() == 1 && !may_be_hidden())
    return project_contour(lamp, reference, camera_, spacing_px_);
  Rigid3 rim_pose = reference;
  auto steps = rim(lamp, reference);
  Contour contour;
  for (const LightNode& node : nodes) {
    const Rigid3 pose = motion_.pose_at(node.time_s);
    if (may_be_hidden()) steps = rim(lamp, rim_pose = pose);  // what is hidden changes
    if (!steps || !lamp.shows_lit_side(pose.origin_in_source())) return std::nullopt;
    const Rigid3 moved = pose * rim_pose.inverse();
    const double light = node.weight * light_change(lamp, motion_.still_pose(), pose);
    for (const RimStep& at : *steps) {
      Eigen::Matrix<double, 2, 3> d_px;
      const auto px = camera_.project(moved * at.point, &d_px);
      if (!px) return std::nullopt;
      const double dy = light * d_px.row(1).dot(moved.rotation * at.step);
      for (const BlurShift& shift : shifts) contour.push_back({*px + shift.px, shift.weight * dy});
    }
  }
  return contour;
}

std::optional<CoverageMoments> LampRenderer::sharp_moments(
    const Lamp& lamp, const std::vector<LightNode>& nodes) const {
  std::vector<Chords> all;
  Chords everywhere;
  for (const LightNode& node : nodes) {
    const Rigid3 pose = motion_.pose_at(node.time_s);
    auto chords = visible_chords(lamp, visible(lamp, pose), pose, camera_);
    if (!chords) return std::nullopt;
    everywhere.insert(everywhere.end(), chords->begin(), chords->end());
    all.push_back(std::move(*chords));
  }
  CoverageMoments moments = dark_moments(everywhere, camera_.width(), camera_.height());
  const Rigid3 reference = motion_.still_pose();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double change =
        nodes.size() == 1 ? 1 : light_change(lamp, reference, motion_.pose_at(nodes[i].time_s));
    add_sharp_coverage(all[i], nodes[i].weight * change, 0, camera_.height(), moments);
  }
  sum_rows(moments);
  return moments;
}

double LampRenderer::centre_irradiance(const Lamp& lamp, const Rigid3& pose) const {
  const auto centre = camera_.project(pose * lamp.centre_m);
  return centre ? irradiance_at(lamp, pose, camera_, frame_.scene.sensor, *centre) : 0;
}

Patch LampRenderer::with_even_light(const Lamp& lamp, const Rigid3& pose, Patch image) const {
  const Sensor& sensor = frame_.scene.sensor;
  const double electrons = sensor.electrons(centre_irradiance(lamp, pose)) - sensor.electrons(0);
  for (double& value : image.values) value *= electrons;
  return image;
}

// Irradiance over a patch and one pixel more on every side, for its derivatives.
Patch LampRenderer::light_around(const Lamp& lamp, const Rigid3& pose, const Patch& image) const {
  const int x0 = image.x0 - 1, y0 = image.y0 - 1, width = image.width + 2,
            height = image.height + 2;
  Patch light;
  if (frame_.plan.applies(Effect::light_gradient)) {
    light = irradiance_field(lamp, pose, camera_, frame_.scene.sensor, x0, y0, x0 + width,
                             y0 + height, frame_.storage.simd());
  } else {
    light = {x0, y0, width, height, {}};
    light.values.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                        centre_irradiance(lamp, pose));
  }
  if (vignetting_)
    for (int y = 0; y < light.height; ++y)
      for (int x = 0; x < light.width; ++x)
        light.values[static_cast<std::size_t>(y * light.width + x)] *=
            vignetting_->transmission(Eigen::Vector2d(light.x0 + x, light.y0 + y));
  return light;
}

Patch LampRenderer::with_light(const Lamp& lamp, const Rigid3& pose, CoverageMoments cover) const {
  Patch image = std::move(cover.c);
  if (image.width == 0) return image;
  const Patch light = light_around(lamp, pose, image);
  const Sensor& sensor = frame_.scene.sensor;
  const double electrons = sensor.electrons(1) - sensor.electrons(0);  // per W/m^2
  const double sigma = psf_ ? psf_->sigma_px() : 0;
  const double half_variance = 0.5 * (sigma * sigma + 1.0 / 12);
  const auto light_row = light_row_for(frame_.storage.simd());
  for (int y = 0; y < image.height; ++y) {
    const double* above = light.values.data() + static_cast<std::ptrdiff_t>(y) * light.width;
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(y) * image.width;
    light_row({above + light.width, above, above + 2 * light.width, cover.m_x.values.data() + first,
               cover.m_y.values.data() + first, electrons, half_variance, image.width},
              image.values.data() + first);
  }
  return image;
}

std::optional<Patch> LampRenderer::extended_image(const Lamp& lamp) const {
  const std::vector<LightNode> at = nodes(lamp);
  const Rigid3 pose = motion_.still_pose();
  if (at.empty()) return Patch{};  // it is dark in all of the exposure
  const bool even = !frame_.plan.applies(Effect::light_gradient) && !vignetting_;
  if (!psf_) {
    auto cover = sharp_moments(lamp, at);
    if (!cover) return std::nullopt;
    return even ? with_even_light(lamp, pose, std::move(cover->c))
                : with_light(lamp, pose, std::move(*cover));
  }
  const auto rim = contour(lamp, at, shifts(lamp, pose));
  if (!rim) return std::nullopt;
  const int width = camera_.width(), height = camera_.height();
  const Simd simd = frame_.storage.simd();
  return even ? with_even_light(lamp, pose, coverage(*rim, *psf_, width, height, simd))
              : with_light(lamp, pose, coverage_moments(*rim, *psf_, width, height, simd));
}

std::optional<Patch> LampRenderer::point_image(const Lamp& lamp, const Lamp& face) const {
  PatchSum image;
  for (const LightNode& node : nodes(lamp)) {
    const Rigid3 pose = motion_.pose_at(node.time_s);
    const auto px = camera_.project(pose * lamp.centre_m);
    if (!px || !lamp.shows_lit_side(pose.origin_in_source())) return std::nullopt;
    const double electrons = node.weight * point_electrons(face, pose, *px);
    if (!psf_) {
      image.add(sharp_dot(*px, camera_.width(), camera_.height()), electrons);
      continue;
    }
    for (const BlurShift& shift : shifts(lamp, pose))
      image.add(point_coverage(*px + shift.px, *psf_, camera_.width(), camera_.height()),
                shift.weight * electrons);
  }
  return image.sum();
}

// The pose in which the lamp is seen gives the field that its light is measured by.
Rigid3 LampRenderer::seen_pose(const Lamp& lamp) const {
  const auto seen = motion_.seen(lamp.centre_m, camera_);
  return seen ? seen->pose : motion_.still_pose();
}

LineImageInput LampRenderer::line_input(const Lamp& lamp) const {
  return {motion_, camera_, lamp, psf_, spacing_px_, panels_per_px(), shifts(lamp, seen_pose(lamp)),
          {},      {},      {}};
}

std::optional<Patch> LampRenderer::point_by_lines(const Lamp& lamp, const Lamp& face) const {
  LineImageInput input = line_input(lamp);
  input.light = [&](double time_s) {
    const Rigid3 pose = motion_.pose_at(time_s);
    const auto px = camera_.project(pose * lamp.centre_m);
    return px ? point_electrons(face, pose, *px) : 0;
  };
  return point_line_image(input);
}

std::optional<Patch> LampRenderer::extended_by_lines(const Lamp& lamp) const {
  const Rigid3 reference = seen_pose(lamp);
  LineImageInput input = line_input(lamp);
  input.light = [&](double time_s) {
    return light_change(lamp, reference, motion_.pose_at(time_s));
  };
  input.chords = [&](const Rigid3& pose) {
    return visible_chords(lamp, visible(lamp, pose), pose, camera_);
  };
  if (may_be_hidden()) input.rim = [&](const Rigid3& pose) { return rim(lamp, pose); };
  auto cover = extended_line_image(input);
  if (!cover) return std::nullopt;
  if (!frame_.plan.applies(Effect::light_gradient) && !vignetting_)
    return with_even_light(lamp, reference, std::move(cover->c));
  return with_light(lamp, reference, std::move(*cover));
}

std::optional<Patch> LampRenderer::render(const Lamp& lamp) const {
  const bool by_lines = motion_.kind(lamp) == Motion::Kind::by_lines;
  if (!is_point(lamp)) return by_lines ? extended_by_lines(lamp) : extended_image(lamp);
  Lamp point = lamp;
  point.shape = LampShape::point;
  return by_lines ? point_by_lines(point, lamp) : point_image(point, lamp);
}

}  // namespace occ
