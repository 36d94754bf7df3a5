# SPDX-License-Identifier: Apache-2.0
"""Animation of a run: the vehicle from above and the image of its camera."""

import io
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse
from PIL import Image

from ..._core import PlanarPose, Renderer, Scene, camera_on_vehicle
from ...guide.experiment import Experiment
from ..maps.picture import INK
from ..progress import Advance
from .pictures import ESTIMATE, STATE_COLOURS, STATES, TRUTH, Columns, draw_room, draw_route

PICTURES, PER_S = 120, 12  # max number of pictures; pictures per second
ENLARGED = 50  # magnification of the error ellipse


def steps_of(run: Columns) -> list[int]:
    """Indices of records, evenly distributed over the run."""
    count = min(PICTURES, len(run["time_s"]))
    return [int(i) for i in np.linspace(0, len(run["time_s"]) - 1, count)]


def lit_scene(experiment: Experiment, time_s: float) -> Scene:
    """Scene at a time; failed lamps are dark."""
    dark = {f.lamp for f in experiment.options.faults.lamp_failures if f.from_s <= time_s < f.to_s}
    if not dark:
        return experiment.scene
    lamps = [lamp.replace(power_w=1e-12) if lamp.id in dark else lamp for lamp in experiment.scene.lamps]
    return experiment.scene.replace(lamps=lamps)


class Stage:
    """Figure of the animation; only its moving parts are redrawn."""

    def __init__(self, experiment: Experiment, run: Columns, title: str):
        self.experiment, self.run = experiment, run
        self.figure = Figure(figsize=(8.8, 4.6), dpi=80, layout="constrained")
        self.canvas: Any = FigureCanvasAgg(self.figure)  # untyped in matplotlib
        above, view = self.figure.subplots(1, 2, width_ratios=(1.1, 1))
        self.above, self.view = above, view
        draw_route(above, experiment.route)
        draw_room(above, experiment.scene)
        room = experiment.scene.room
        if room is not None:
            above.set(xlim=(0, room.size_m[0]), ylim=(0, room.size_m[1]))
        above.set_aspect("equal")
        above.tick_params(labelsize=7)
        (self.driven,) = above.plot([], [], color=TRUTH, lw=1.2)
        self.body = above.add_patch(Circle((0, 0), experiment.options.vehicle.radius_m, color=TRUTH, alpha=0.35))
        (self.nose,) = above.plot([], [], color=INK, lw=1.5)
        self.error = above.add_patch(Ellipse((0, 0), 0, 0, fill=False, color=ESTIMATE, lw=1.5))
        camera = experiment.scene.camera
        self.image = view.imshow(np.zeros((camera.height, camera.width)), cmap="gray", vmin=0, vmax=1)
        view.set_axis_off()
        self.figure.suptitle(title, fontsize=9, color=INK)
        self.renderers: dict[str, Renderer] = {}

    def draw(self, step: int) -> Image.Image:
        run = self.run
        x, y, heading = (float(run[f"true_{key}"][step]) for key in ("x_m", "y_m", "heading_rad"))
        self.driven.set_data(run["true_x_m"][: step + 1], run["true_y_m"][: step + 1])
        self.body.center = (x, y)
        reach = self.experiment.options.vehicle.radius_m
        self.nose.set_data([x, x + reach * np.cos(heading)], [y, y + reach * np.sin(heading)])
        state = int(run["state"][step])
        self.error.set_visible(state in (1, 2))
        self.error.center = (float(run["x_m"][step]), float(run["y_m"][step]))
        self.error.width, self.error.height = (
            float(2 * 3 * ENLARGED * run[f"sigma_{key}"][step]) for key in ("x_m", "y_m")
        )
        time_s = float(run["time_s"][step])
        self.above.set_title(
            f"{time_s:.1f} s, {STATES[state]}, {int(run['lamps'][step])} lamps; ellipse: 3 sigma x {ENLARGED}",
            fontsize=8,
        )
        self.above.set_facecolor(STATE_COLOURS[state])
        self.image.set_data(self.camera_image(time_s, PlanarPose(x_m=x, y_m=y, heading_rad=heading), step))
        self.canvas.draw()
        return Image.fromarray(np.asarray(self.canvas.buffer_rgba())).convert("P", palette=Image.Palette.ADAPTIVE)

    def camera_image(self, time_s: float, pose: PlanarPose, step: int) -> Any:
        scene = lit_scene(self.experiment, time_s)
        key = ",".join(str(lamp.power_w) for lamp in scene.lamps)
        if key not in self.renderers:
            self.renderers[key] = Renderer(scene)
        mount = camera_on_vehicle(
            self.experiment.options.camera_place_m, float(self.run["pan_rad"][step]), float(self.run["tilt_rad"][step])
        )
        image, _ = self.renderers[key].render(mount @ pose.body_from_world(), frame=step, start_s=time_s)
        return image / np.iinfo(image.dtype).max


def animated(experiment: Experiment, run: Columns, title: str, advance: Advance) -> bytes:
    """Animation as a GIF."""
    stage = Stage(experiment, run, title)
    pictures = []
    for step in steps_of(run):
        pictures.append(stage.draw(step))
        advance()
    file = io.BytesIO()
    pictures[0].save(
        file, format="GIF", save_all=True, append_images=pictures[1:], duration=1000 // PER_S, loop=0, optimize=False
    )
    return file.getvalue()
