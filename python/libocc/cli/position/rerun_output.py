# SPDX-License-Identifier: Apache-2.0
"""Recording for the Rerun viewer: lamps, camera, path, errors and states."""

import importlib
from typing import Any

import numpy as np

from ..._core import Scene
from .outputs import require_writable
from .record import Record

LEVELS = {"tracking": "INFO", "coasting": "WARN", "searching": "WARN", "lost": "ERROR", "skipped": "WARN"}
PIECE = 30  # poses per piece of the path, which may grow without limit


class RerunOutput:
    """Writes an .rrd file. Raises: ValueError without rerun-sdk; OSError when the file cannot be created."""

    def __init__(self, path: str, scene: Scene):
        self.name = path
        try:
            self._rr: Any = importlib.import_module("rerun")
        except ImportError as error:
            raise ValueError(f"{path}: requires Rerun: pip install 'libocc[rerun]'") from error
        require_writable(path)
        with open(path, "wb"):  # the thread of the recorder would report an error only at the end
            pass
        self._out = self._rr.RecordingStream("libocc position")
        try:
            self._out.save(path)
        except RuntimeError as error:
            raise self._named(error) from error
        self._piece: list[Any] = []
        self._pieces = 0
        self._state = ""
        self._room(scene)

    def _room(self, scene: Scene) -> None:
        rr = self._rr
        self._out.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        if scene.lamps:
            self._out.log("world/lamps", rr.Points3D(
                [lamp.centre_m for lamp in scene.lamps], labels=[str(lamp.id) for lamp in scene.lamps],
                radii=0.05, colors=[255, 190, 40],
            ), static=True)
        if scene.room is not None:
            half = np.asarray(scene.room.size_m) / 2
            self._out.log("world/room", rr.Boxes3D(centers=[half], half_sizes=[half]), static=True)
        self._camera = scene.camera
        if scene.camera.kind.name == "pinhole":
            self._out.log("world/camera", rr.Pinhole(
                image_from_camera=[[self._camera.fx_px, 0, self._camera.cx_px],
                                   [0, self._camera.fy_px, self._camera.cy_px], [0, 0, 1]],
                width=self._camera.width, height=self._camera.height, camera_xyz=rr.ViewCoordinates.RDF,
            ), static=True)

    def add(self, record: Record) -> None:
        rr = self._rr
        if record.time_s is None:
            return
        self._out.set_time("time", duration=record.time_s)
        self._out.set_time("frame", sequence=record.frame)
        if record.state != self._state or record.warning:
            self._state = record.state
            message = "; ".join(text for text in (record.state, record.reason, record.warning) if text)
            self._out.log("states", rr.TextLog(message, level=LEVELS.get(record.state, "INFO")))
        self._out.log("lamps_seen", rr.Scalars(len(record.lamps)))
        if record.blobs_px:
            labels = [str(id) for id in record.lamps]
            self._out.log("world/camera/lamps", rr.Points2D(np.array(record.blobs_px), labels=labels, radii=4))
        if record.pose is None:
            return
        pose = record.pose
        self._out.log("world/camera", rr.Transform3D(
            translation=pose.position_m, mat3x3=pose.cam_from_world[:3, :3].T
        ))
        self._out.log("sigma_mm", rr.Scalars(1e3 * pose.sigmas_m))
        if record.error_m is not None:
            self._out.log("error_mm", rr.Scalars(1e3 * record.error_m))
        if not record.predicted:
            self._piece.append(pose.position_m)
            if len(self._piece) > PIECE:
                self._draw_piece()

    def _draw_piece(self) -> None:
        if len(self._piece) > 1:
            line = self._rr.LineStrips3D([np.array(self._piece)], colors=[0, 114, 178])
            self._out.log(f"world/path/{self._pieces}", line)
            self._pieces += 1
        self._piece = self._piece[-1:]

    def close(self) -> str:
        self._draw_piece()
        try:
            self._out.flush()
        except Exception as error:  # raised in the thread of the recorder
            raise self._named(error) from error
        finally:
            self._out.disconnect()
        return ""

    def _named(self, error: Exception) -> OSError:
        return OSError(f"{self.name}: cannot be written: {error}")
