// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/lamp_image.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/formation/internal/sharp_coverage.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/simulate/internal/irradiance_field.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace {

// Puts all light into the pixel that contains the point.
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
          all.values[(part.y0 + y - all.y0) * all.width + part.x0 + x - all.x0] +=
              part.at(part.x0 + x, part.y0 + y);
    return all;
  }

 private:
  std::vector<Patch> parts_;
};

}  // namespace

LampRenderer::LampRenderer(const Frame& frame, const Camera& camera)
    : frame_(frame), camera_(camera), motion_(frame) {
  if (frame.plan.applies(Effect::vignetting)) vignetting_.emplace(frame.scene);
  if (!frame.plan.applies(Effect::psf)) return;
  blur_ = &frame.storage.blur(gaussian_blur_px(frame.scene));
  psf_ = &blur_->psf;
  spacing_px_ = frame.options.spacing_sigma * psf_->sigma_px();
}

// Parts of the exposure per pixel of motion. A part is at most 0.7 sigma of the blurred pixel long,
// or 1/8 of a pixel without blur.
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
  const double depth_m = camera_.depth_m(pose * lamp.centre_m);
  const double radius = psf_ ? defocus_radius_px(frame_.scene, depth_m) : 0;
  std::vector<BlurShift> shifts = disc_shifts(radius, psf_ ? psf_->sigma_px() : 1);
  if (radius == 0 || is_point(lamp)) return shifts;
  const Eigen::Vector2d gradient = log_light_gradient(lamp, pose);
  for (BlurShift& shift : shifts) shift.weight *= 1 - shift.px.dot(gradient);
  return shifts;
}

// Ratio of the light from a pose to the light field of the reference pose at the lamp's position.
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

// Rim in the camera's frame at this pose.
std::optional<RimContour> LampRenderer::rim(const Lamp& lamp, const Rigid3& pose) const {
  if (!may_be_hidden()) return rim_contour(lamp, pose, camera_, spacing_px_);
  return visible_rim(lamp, visible(lamp, pose), pose, camera_, spacing_px_);
}

bool LampRenderer::contour(const Lamp& lamp, const std::vector<LightNode>& nodes,
                           const std::vector<BlurShift>& shifts, Contour& contour) const {
  const Rigid3 reference = motion_.pose_at(nodes[nodes.size() / 2].time_s);
  if (nodes.size() == 1 && shifts.size() == 1 && !may_be_hidden())
    return project_contour(lamp, reference, camera_, spacing_px_, contour);
  Rigid3 rim_pose = reference;
  auto steps = rim(lamp, reference);
  contour.clear();
  for (const LightNode& node : nodes) {
    const Rigid3 pose = motion_.pose_at(node.time_s);
    if (may_be_hidden()) steps = rim(lamp, rim_pose = pose);  // the hidden part changes
    if (!steps || !lamp.shows_lit_side(pose.origin_in_source())) return false;
    const Rigid3 moved = pose * rim_pose.inverse();
    const double light = node.weight * light_change(lamp, motion_.still_pose(), pose);
    for (const RimStep& at : *steps) {
      Eigen::Matrix<double, 2, 3> d_px;
      const auto px = camera_.project(moved * at.point, &d_px);
      if (!px) return false;
      const double dy = light * d_px.row(1).dot(moved.rotation * at.step);
      for (const BlurShift& shift : shifts) contour.push_back({*px + shift.px, shift.weight * dy});
    }
  }
  return true;
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

double LampRenderer::even_electrons(const Lamp& lamp, const Rigid3& pose) const {
  const Sensor& sensor = frame_.scene.sensor;
  return sensor.electrons(centre_irradiance(lamp, pose)) - sensor.electrons(0);
}

Patch LampRenderer::with_even_light(const Lamp& lamp, const Rigid3& pose, Patch image) const {
  const double electrons = even_electrons(lamp, pose);
  for (double& value : image.values) value *= electrons;
  return image;
}

// Irradiance over a patch with one more pixel on each side for derivatives, and possibly more on
// the right.
const PatchOf<float>& LampRenderer::light_around(const Lamp& lamp, const Rigid3& pose, int x0,
                                                 int y0, int width, int height) const {
  PatchOf<float>& light = frame_.storage.lamp.light;
  light.x0 = x0 - 1;
  light.y0 = y0 - 1;
  light.width = width + 2;
  light.height = height + 2;
  if (frame_.plan.applies(Effect::light_gradient))
    frame_.storage.lamp.field.fill(lamp, pose, camera_, frame_.scene.sensor, light);
  else
    light.values.assign(
        static_cast<std::size_t>(light.width) * static_cast<std::size_t>(light.height),
        static_cast<float>(centre_irradiance(lamp, pose)));
  if (vignetting_)
    for (int y = 0; y < light.height; ++y)
      for (int x = 0; x < light.width; ++x)
        light.values[y * light.width + x] *= static_cast<float>(
            vignetting_->transmission(Eigen::Vector2d(light.x0 + x, light.y0 + y)));
  return light;
}

// Calls visit(row of the image, its light) for each row.
template <typename AnyPatch, typename Visit>
void LampRenderer::for_lit_rows(const Lamp& lamp, const Rigid3& pose, const AnyPatch& image,
                                Visit visit) const {
  const PatchOf<float>& light =
      light_around(lamp, pose, image.x0, image.y0, image.width, image.height);
  const Sensor& sensor = frame_.scene.sensor;
  const double electrons = sensor.electrons(1) - sensor.electrons(0);  // per W/m^2
  const double sigma = psf_ ? psf_->sigma_px() : 0;
  const double half_variance = 0.5 * (sigma * sigma + 1.0 / 12);
  for (int y = 0; y < image.height; ++y) {
    const float* above = light.values.data() + static_cast<std::ptrdiff_t>(y) * light.width;
    visit(y, RowLight{above + light.width, above, above + 2 * light.width, electrons, half_variance,
                      image.width});
  }
}

Patch LampRenderer::with_light(const Lamp& lamp, const Rigid3& pose, CoverageMoments cover) const {
  Patch image = std::move(cover.c);
  if (image.width == 0) return image;
  for_lit_rows(lamp, pose, image, [&](int y, const RowLight& row) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(y) * image.width;
    light_row(frame_.storage.simd(), row, cover.m_x.values.data() + first,
              cover.m_y.values.data() + first, image.values.data() + first);
  });
  return image;
}

bool LampRenderer::is_evenly_lit() const {
  return !frame_.plan.applies(Effect::light_gradient) && !vignetting_;
}

bool LampRenderer::sharp_image(const Lamp& lamp, const std::vector<LightNode>& at,
                               PaddedPatch& image) const {
  auto cover = sharp_moments(lamp, at);
  if (!cover) return false;
  const Rigid3 pose = motion_.still_pose();
  image = PaddedPatch(is_evenly_lit() ? with_even_light(lamp, pose, std::move(cover->c))
                                      : with_light(lamp, pose, std::move(*cover)));
  return true;
}

bool LampRenderer::extended_image(const Lamp& lamp, PaddedPatch& image) const {
  image.resize(0, 0, 0, 0);
  const std::vector<LightNode> at = nodes(lamp);
  if (at.empty()) return true;  // the lamp is dark during the whole exposure
  if (!psf_) return sharp_image(lamp, at, image);
  const Rigid3 pose = motion_.still_pose();
  LampMemory& memory = frame_.storage.lamp;
  if (!contour(lamp, at, shifts(lamp, pose), memory.contour)) return false;
  const int width = camera_.width(), height = camera_.height();
  const Simd simd = frame_.storage.simd();
  if (!is_evenly_lit() && !blur_->moments) {
    image = PaddedPatch(
        with_light(lamp, pose, coverage_moments(memory.contour, *psf_, width, height, simd)));
    return true;
  }
  const CoverageRows cover = memory.coverage.paint(memory.contour, *psf_, width, height);
  image.resize(cover.x0, cover.y0, cover.width, cover.height);
  if (cover.width == 0) return true;
  if (is_evenly_lit()) {
    const double electrons = even_electrons(lamp, pose);
    for (int y = 0; y < cover.height; ++y)
      light_row(simd, electrons, cover.first + y * cover.stride, cover.width, image.row(y));
    return true;
  }
  for_lit_rows(lamp, pose, image, [&](int y, const RowLight& row) {
    light_row(simd, row, cover.first + y * cover.stride, cover.stride, blur_->moments->taps(),
              image.row(y));
  });
  return true;
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

// Reference pose of the light field: the pose from which the lamp's centre is seen.
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
  if (is_evenly_lit()) return with_even_light(lamp, reference, std::move(cover->c));
  return with_light(lamp, reference, std::move(*cover));
}

bool LampRenderer::render(const Lamp& lamp, PaddedPatch& image) const {
  const bool by_lines = motion_.kind(lamp) == Motion::Kind::by_lines;
  if (!is_point(lamp) && !by_lines) return extended_image(lamp, image);
  std::optional<Patch> rendered;
  if (is_point(lamp)) {
    Lamp point = lamp;
    point.shape = LampShape::point;
    rendered = by_lines ? point_by_lines(point, lamp) : point_image(point, lamp);
  } else {
    rendered = extended_by_lines(lamp);
  }
  if (!rendered) return false;
  image = PaddedPatch(*rendered);
  return true;
}

}  // namespace occ::internal::simulate
