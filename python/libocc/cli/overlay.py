# SPDX-License-Identifier: Apache-2.0
"""Annotated pictures: blobs, assigned lamps and residuals drawn over an image."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from .._core import (
    Blob,
    Camera,
    Decoded,
    Fix,
    Identification,
    Lamp,
    Object,
    Recognition,
    Rung,
    Scene,
    Truth,
    log_irradiance_gradient,
    project_lamp_centre,
    project_rim,
)
from . import report
from .labels import Label, add_labels, text_size, wrapped

Pixels = NDArray[np.uint8 | np.uint16]
Array = NDArray[np.float64]

MEASURED, PREDICTED, RESIDUAL, UNUSED = "#40c4ff", "#7cff6b", "#ff5c8a", "#ffb340"
OUTLINE = [withStroke(linewidth=3, foreground="black")]
MAX_SIDE_PX = 1600  # larger images are reduced: the picture has a width of 1100 pixels
MAX_CLOSE_UPS = 6
BACKGROUND, WIDTH_IN, CLOSE_UP_IN = "#181818", 9.6, 1.6
DPI, EDGE = 110, 0.02  # EDGE: free part of the width on each side
FAINT, NEAR_PX = 0.02, 10  # part of the faintest lamp's flux; distance that names the nearest lamp
MAX_REASONS = 12  # of the brightest blobs: more labels would cover the picture
TITLE_PT, CAPTION_PT, NOTE_PT, LABEL_PT = 11, 9, 8, 10


@dataclass
class Mark:
    """One lamp in a picture: its measured image, its predicted image, or both.

    predicted_px: predicted centroid, comparable with the blob's.
    """

    label: str
    centre_px: Array
    radius_px: float
    blob: Blob | None = None
    rim_px: Array | None = None
    predicted_px: Array | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def reach_px(self) -> tuple[float, float]:
        """Half sides of the box around the lamp."""
        if self.blob is None:
            return self.radius_px, self.radius_px
        return (self.blob.x1 - self.blob.x0) / 2 + 1.0, (self.blob.y1 - self.blob.y0) / 2 + 1.0

    @property
    def residual_px(self) -> Array | None:
        """Measured minus predicted centre; None for a lamp cut by the border, whose centroid is biased."""
        if self.blob is None or self.predicted_px is None or self.blob.cut_by_border:
            return None
        return np.asarray(self.blob.centroid_px - self.predicted_px)


def draw(path: str | PathLike[str], image: Pixels, *, blobs: Sequence[Blob], title: str = "") -> None:
    """Writes a picture of an image's blobs, numbered in their order (PNG by the name's ending).

    image: as for detect(). Raises: OSError when it cannot be written.
    """
    marks = [_blob_mark(str(i), blob) for i, blob in enumerate(blobs)]
    for mark in marks:
        assert mark.blob is not None
        mark.notes = [f"± {report.sigma_px(mark.blob):.3f} px", ", ".join(report.flags(mark.blob))]
    _picture(path, image, marks, [], title, "blue: measured outline and rim points")


def draw_decoded(path: str | PathLike[str], image: Pixels, found: Decoded, *, title: str = "") -> None:
    """Writes a picture of the lights of a sequence with their decoded ids.

    image: for instance the maximum over all frames. Raises: OSError when it cannot be written.
    """
    marks = []
    for lamp, blob in zip(found.lamps, found.blobs, strict=True):
        decoded = lamp.code.status.name if lamp.id is None else f"id {lamp.id}"
        mark = _blob_mark(decoded if blob.lamp_id is None else f"{decoded}: lamp {blob.lamp_id}", blob)
        mark.notes = [f"{100 * lamp.code.explained:.0f} % of its light explained"]
        marks.append(mark)
    _picture(path, image, marks, [], title, "blue: detected lights; image: maximum over all frames")


def draw_fix(path: str | PathLike[str], image: Pixels, fix: Fix, scene: Scene, *, title: str = "") -> None:
    """Writes a picture of a fix: lamps with their ids, predicted rims, residuals, unused blobs.

    Raises: OSError when it cannot be written.
    """
    marks = []
    if fix.candidates:
        lamps = {lamp.id: lamp for lamp in scene.lamps}
        for id, blob in fix.lamps.items():
            mark = _blob_mark(f"lamp {id}", blob)
            mark.rim_px = project_rim(lamps[id], fix.cam_from_world, scene.camera, 90)
            if not (blob.hidden_in_part and len(blob.corners_px)):  # its centroid is that of the visible part
                mark.predicted_px = _predicted_centroid(lamps[id], blob, fix, scene)
            residual = mark.residual_px
            if residual is not None:
                mark.notes = [f"off by {np.hypot(*residual):.3f} ± {report.sigma_px(blob):.3f} px"]
            mark.notes.append(", ".join(report.flags(blob)))
            marks.append(mark)
    used = [blob.centroid_px for blob in fix.lamps.values()]
    unused = [b for b in fix.blobs if not any(np.array_equal(b.centroid_px, u) for u in used)]
    reasons = [unused_reason(blob, fix, scene) for blob in unused]
    _picture(path, image, marks, unused, f"{title}   {_fix_line(fix)}", _fix_caption(fix), reasons)


def unused_reason(blob: Blob, fix: Fix, scene: Scene) -> str:
    """Reason why a blob of a fix is not the image of a lamp, in a few words."""
    if blob.cut_by_border:
        return "cut by the border"
    if blob.merged:
        return "shape of no lamp"
    if not fix.candidates:
        return "no pose"
    fluxes = [seen.flux_dn for seen in fix.lamps.values() if seen.flux_dn > 0]
    if fluxes and blob.flux_dn < FAINT * min(fluxes):
        return "too faint"
    offset_px, nearest = np.inf, None
    for lamp in scene.lamps:
        predicted = project_lamp_centre(lamp, fix.cam_from_world, scene.camera)
        if predicted is None:
            continue
        distance = float(np.hypot(*(blob.centroid_px - predicted)))
        if distance < offset_px:
            offset_px, nearest = distance, lamp.id
    if nearest in fix.excluded_lamps:
        return f"lamp {nearest} contradicts"
    reach = max(blob.x1 - blob.x0, blob.y1 - blob.y0) / 2 + NEAR_PX
    if nearest is not None and offset_px < reach:
        return f"{offset_px:.1f} px from lamp {nearest}"
    return "no lamp there"


def draw_identification(
    path: str | PathLike[str],
    image: Pixels,
    blobs: Sequence[Blob],
    found: Identification,
    scene: Scene,
    *,
    title: str = "",
) -> None:
    """Writes a picture of an image's blobs with the lamps assigned to them in the most likely pose.

    Raises: OSError when it cannot be written.
    """
    marks: list[Mark] = []
    assigned: set[int] = set()
    if found.hypotheses:
        best = found.hypotheses[0]
        for match in best.matches:
            lamp = scene.lamps[match.lamp]
            mark = _blob_mark(f"lamp {lamp.id}", blobs[match.blob])
            mark.predicted_px = project_lamp_centre(lamp, best.cam_from_world, scene.camera)
            marks.append(mark)
            assigned.add(match.blob)
    unused = [blob for i, blob in enumerate(blobs) if i not in assigned]
    verdict = found.status.name + (f": {found.message}" if found.message else "")
    caption = f"{_poses(len(found.hypotheses))}   blue: measured, orange: not assigned"
    _picture(path, image, marks, unused, f"{title}   {verdict}", caption)


def draw_recognition(
    path: str | PathLike[str],
    image: Pixels,
    blobs: Sequence[Blob],
    found: Recognition,
    objects: Sequence[Object],
    camera: Camera,
    *,
    title: str = "",
) -> None:
    """Writes a picture of an image's blobs with the recognised objects and their points.

    Raises: OSError when it cannot be written.
    """
    marks: list[Mark] = []
    assigned: set[int] = set()
    for recognised in found.found:
        thing, best = objects[recognised.match.object], recognised.match.poses[0]
        top = min(best.matches, key=lambda m: float(blobs[m.blob].centroid_px[1]))
        for match in best.matches:
            point = thing.points[match.lamp]
            name = f"{thing.name}: {point.id}" if match is top else str(point.id)
            mark = _blob_mark(name, blobs[match.blob])
            in_cam = best.cam_from_world[:3, :3] @ point.position_m + best.cam_from_world[:3, 3]
            mark.predicted_px = camera.project(in_cam)
            mark.notes = [f"{thing.name}: {point.label}" if point.label else thing.name]
            marks.append(mark)
            assigned.add(match.blob)
    unused = [blob for i, blob in enumerate(blobs) if i not in assigned]
    verdict = found.status.name + (f": {found.message}" if found.message else "")
    chances = ", ".join(f"{objects[o.match.object].name} 10^{o.match.log10_false_alarms:.0f}" for o in found.found)
    caption = f"expected false alarms: {chances or '-'}   blue: measured, orange: not assigned"
    _picture(path, image, marks, unused, f"{title}   {verdict}", caption)


def draw_truth(path: str | PathLike[str], image: Pixels, truth: Truth, *, title: str = "") -> None:
    """Writes a picture of a rendered image with the true rims and lamp ids.

    Raises: OSError when it cannot be written.
    """
    marks = []
    for lamp in truth.lamps:
        if lamp.in_view:
            centre = np.asarray(lamp.image_centre_px)
            reach = np.abs(lamp.rim_px - centre).max() if len(lamp.rim_px) else 3.0
            notes = [] if lamp.whole else ["cut by the border"]
            rim = lamp.rim_px if len(lamp.rim_px) > 1 else None
            mark = Mark(f"lamp {lamp.id}", centre, float(reach), rim_px=rim, notes=notes)
            marks.append(mark)
    x, y, z = truth.position_m
    _picture(path, image, marks, [], f"{title}   camera at {x:.3f} {y:.3f} {z:.3f} m", "green: truth")


def _predicted_centroid(lamp: Lamp, blob: Blob, fix: Fix, scene: Scene) -> Array | None:
    """Centroid that the refinement compares with the blob's.

    It is the projection of the lamp's centre for Rung.points. Otherwise it is the centre of the lamp's image, shifted
    by the gradient of its light.
    """
    at_centre = scene.camera.project(fix.cam_from_world[:3, :3] @ lamp.centre_m + fix.cam_from_world[:3, 3])
    if fix.choice is not None and fix.choice.rung is Rung.points:
        return at_centre
    centre = project_lamp_centre(lamp, fix.cam_from_world, scene.camera)
    if centre is None or at_centre is None or not blob.light_response_px2.any():
        return centre
    gradient = log_irradiance_gradient(lamp, fix.cam_from_world, scene.camera, scene.sensor, at_centre)
    return np.asarray(centre + blob.light_response_px2 @ gradient)


def _fix_line(fix: Fix) -> str:
    return fix.status.name if fix.ok else f"{fix.status.name}: {fix.message}"


def _poses(count: int) -> str:
    return f"{count} pose" if count == 1 else f"{count} poses"


def _fix_caption(fix: Fix) -> str:
    if not fix.candidates:
        return "no pose"
    eigenvalues = np.linalg.eigvalsh(fix.position_covariance_m2)[::-1]
    axes = " x ".join(f"{np.sqrt(max(v, 0)) * 1e3:.2f}" for v in eigenvalues)
    position = " ".join(f"{v:.4f}" for v in fix.position_m)
    sigmas = " ".join(f"{s:.2f}" for s in report.sigmas_mm(fix))
    return (
        f"position {position} m   sigma {sigmas} mm   1-sigma ellipsoid {axes} mm\n"
        f"rms of the residuals {fix.rms_px:.3f} px{_redundancy(fix)}   {_poses(len(fix.candidates))}   "
        "blue: measured, green: predicted, orange: not used"
    )


def _redundancy(fix: Fix) -> str:
    """Note on a fix whose residuals are zero for any measurements: as many coordinates as unknowns."""
    by_centres = fix.choice is not None and fix.choice.rung in (Rung.points, Rung.centres)
    centres = sum(not blob.cut_by_border for blob in fix.lamps.values())
    return " (no check: a pose fits any three centres)" if by_centres and centres <= 3 else ""


def _blob_mark(label: str, blob: Blob) -> Mark:
    reach = max(blob.x1 - blob.x0, blob.y1 - blob.y0) / 2 + 1
    return Mark(label, np.asarray(blob.centroid_px), float(reach), blob=blob)


def _picture(
    path: str | PathLike[str],
    image: Pixels,
    marks: list[Mark],
    unused: Sequence[Blob],
    title: str,
    caption: str,
    reasons: Sequence[str] = (),
) -> None:
    height, width = image.shape[:2]
    close_ups = marks[:MAX_CLOSE_UPS]
    figure = Figure(figsize=(WIDTH_IN / 0.96, 1), dpi=DPI, facecolor=BACKGROUND)
    canvas = FigureCanvasAgg(figure)
    text_px = WIDTH_IN * DPI * 0.99
    title = wrapped(figure, title, text_px, TITLE_PT)
    line_in = 1.25 * text_size(figure, "Ag", TITLE_PT)[1] / DPI
    caption_line_in = 1.25 * text_size(figure, "Ag", CAPTION_PT)[1] / DPI
    notes = [_notes(figure, mark, len(close_ups)) for mark in close_ups]
    arrows, magnified = _residual_arrows(marks, 0.05 * width)
    if magnified:
        caption += f"   arrows: residuals x {magnified:g}"
    caption = wrapped(figure, caption, text_px, CAPTION_PT)
    # Heights from top to bottom: title, image, close-ups with their notes, caption.
    top_in = 0.15 + line_in * (1 + title.count("\n"))
    frame_in = WIDTH_IN * min(height / width, 1.4)
    strip_in = 0.1 + CLOSE_UP_IN if close_ups else 0.0
    notes_in = max((text_size(figure, note, NOTE_PT)[1] for note in notes), default=0) / DPI
    bottom_in = 0.25 + notes_in + caption_line_in * (1 + caption.count("\n"))
    height_in = top_in + frame_in + strip_in + bottom_in
    figure.set_size_inches(WIDTH_IN / 0.96, height_in)
    rows = figure.add_gridspec(
        2 if close_ups else 1,
        max(len(close_ups), 1),
        height_ratios=[frame_in, CLOSE_UP_IN] if close_ups else None,
        left=EDGE,
        right=1 - EDGE,
        top=1 - top_in / height_in,
        bottom=bottom_in / height_in,
        hspace=0.2 / (frame_in + CLOSE_UP_IN),
        wspace=0.06,
    )
    _draw_frame(figure.add_subplot(rows[0, :]), image, marks, unused, arrows, reasons)
    for i, (mark, note) in enumerate(zip(close_ups, notes, strict=True)):
        _draw_close_up(figure.add_subplot(rows[1, i]), image, mark, note)
    figure.text(EDGE, 1 - 0.1 / height_in, title, color="white", fontsize=TITLE_PT, va="top")
    figure.text(EDGE, 0.1 / height_in, caption, color="#d0d0d0", fontsize=CAPTION_PT, va="bottom")
    canvas.print_figure(path, facecolor=BACKGROUND)


def _notes(figure: Figure, mark: Mark, columns: int) -> str:
    """Text below a close-up, as wide as its column."""
    text = "\n".join([mark.label, *filter(None, mark.notes)])
    return wrapped(figure, text, 0.98 * DPI * WIDTH_IN / (columns + 0.06 * (columns - 1)), NOTE_PT)


def _brightened(image: Pixels) -> Array:
    """Grey levels or colours scaled to 0..1 with a gamma of 0.6, which brightens dark regions."""
    levels = image if image.ndim == 2 else image[..., :3]
    top = max(float(levels.max()), 1.0)
    return np.asarray((levels / top) ** 0.6)


def _shrunk(image: Pixels) -> Pixels:
    """Image reduced to MAX_SIDE_PX by the maximum of each block, which keeps small lamps visible."""
    step = -(-max(image.shape[:2]) // MAX_SIDE_PX)
    if step == 1:
        return image
    height, width = image.shape[0] // step * step, image.shape[1] // step * step
    whole = image[:height, :width]
    blocks = whole.reshape(height // step, step, width // step, step, *image.shape[2:])
    return np.asarray(blocks.max(axis=(1, 3)))


def _bare(axes: Axes) -> None:
    axes.set_facecolor("#303030")
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_color("#606060")


def _draw_frame(
    axes: Axes,
    image: Pixels,
    marks: list[Mark],
    unused: Sequence[Blob],
    arrows: list[tuple[Array, Array]],
    reasons: Sequence[str] = (),
) -> None:
    height, width = image.shape[:2]
    extent = (-0.5, width - 0.5, height - 0.5, -0.5)
    axes.imshow(_brightened(_shrunk(image)), cmap="gray", vmin=0, vmax=1, extent=extent)
    axes.set_xlim(extent[:2])
    axes.set_ylim(extent[2:])
    axes.apply_aspect()
    _bare(axes)
    for blob in unused:
        _draw_measured(axes, blob, UNUSED)
    for mark in marks:
        _draw_outline(axes, mark, 1.2)
    for start, tip in arrows:
        arrow = {"arrowstyle": "-|>", "color": RESIDUAL, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", xy=(tip[0], tip[1]), xytext=(start[0], start[1]), arrowprops=arrow)
    covered = [start + part * (tip - start) for start, tip in arrows for part in (0.25, 0.5, 0.75, 1)]
    labels = [Label(m.label, (m.centre_px[0], m.centre_px[1]), m.reach_px, "white") for m in marks]
    for blob, reason in list(zip(unused, reasons, strict=False))[:MAX_REASONS]:  # by decreasing flux
        mark = _blob_mark(reason, blob)
        labels.append(Label(reason, (mark.centre_px[0], mark.centre_px[1]), mark.reach_px, UNUSED))
    add_labels(axes, labels, LABEL_PT, obstacles=np.array(covered), path_effects=OUTLINE)


def _residual_arrows(marks: list[Mark], wanted_px: float) -> tuple[list[tuple[Array, Array]], float]:
    """Enlarged residuals from the predicted to the measured centre, and their magnification (0 without residuals)."""
    found = [(m.predicted_px, m.residual_px) for m in marks]
    pairs = [(start, residual) for start, residual in found if start is not None and residual is not None]
    longest = max((float(np.hypot(*residual)) for _, residual in pairs), default=0.0)
    if longest <= 0:
        return [], 0.0
    magnified = _round_below(max(wanted_px / longest, 1.0))
    return [(start, start + magnified * residual) for start, residual in pairs], magnified


def _round_below(value: float) -> float:
    """Largest of 1, 2, 5, 10, 20, ... that is not above `value` (>= 1)."""
    power = float(10 ** np.floor(np.log10(value)))
    return power * max(step for step in (1, 2, 5) if step * power <= value)


def _draw_outline(axes: Axes, mark: Mark, width: float) -> None:
    if mark.blob is not None:
        _draw_measured(axes, mark.blob, MEASURED)
        axes.plot(*mark.blob.centroid_px, "+", color=MEASURED, ms=6, mew=1)
    if mark.rim_px is not None:
        _draw_closed(axes, mark.rim_px, PREDICTED, width)


def _draw_closed(axes: Axes, points_px: Array, colour: str, width: float) -> None:
    closed = np.vstack([points_px, points_px[:1]])
    axes.plot(closed[:, 0], closed[:, 1], "-", color=colour, lw=width)


def _draw_measured(axes: Axes, blob: Blob, colour: str) -> None:
    """Sides of a blob with corners, rim points of another outline, or the ellipse."""
    if len(blob.corners_px):
        _draw_closed(axes, np.asarray(blob.corners_px), colour, 1.2)
        return
    if blob.free_form and len(blob.rim):
        axes.plot(blob.rim[:, 0], blob.rim[:, 1], ".", color=colour, ms=1.5)
        return
    ellipse = blob.ellipse
    patch: Any = Ellipse(
        (float(ellipse.centre_px[0]), float(ellipse.centre_px[1])),
        2 * ellipse.semi_major_px,
        2 * ellipse.semi_minor_px,
        angle=float(np.degrees(ellipse.angle_rad)),
        fill=False,
        edgecolor=colour,
        linewidth=1.2,
    )
    axes.add_patch(patch)


def _draw_close_up(axes: Axes, image: Pixels, mark: Mark, note: str) -> None:
    height, width = image.shape[:2]
    reach = 1.35 * mark.radius_px + 2
    x, y = mark.centre_px
    x0, x1 = int(max(x - reach, 0)), int(min(x + reach + 2, width))
    y0, y1 = int(max(y - reach, 0)), int(min(y + reach + 2, height))
    if x1 > x0 and y1 > y0:
        part = _brightened(_shrunk(image[y0:y1, x0:x1]))
        extent = (x0 - 0.5, x1 - 0.5, y1 - 0.5, y0 - 0.5)
        axes.imshow(part, cmap="gray", vmin=0, vmax=1, extent=extent, interpolation="nearest")
    if mark.blob is not None and len(mark.blob.rim):
        axes.plot(mark.blob.rim[:, 0], mark.blob.rim[:, 1], ".", color=MEASURED, ms=4)
        mark = replace(mark, blob=None)
    _draw_outline(axes, mark, 0.8)
    axes.set_xlim(x - reach, x + reach)
    axes.set_ylim(y + reach, y - reach)
    _bare(axes)
    axes.set_xlabel(note, color="#e0e0e0", fontsize=NOTE_PT)
