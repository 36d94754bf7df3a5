# SPDX-License-Identifier: Apache-2.0
"""Identification of lamps by the frequency of their rolling-shutter stripes, over all frames of a sequence."""

from dataclasses import dataclass, field

import numpy as np

from .._core import Blob, Scene, detect
from .progress import progress
from .sequence_frames import Frames

TOLERANCE = 0.02  # relative difference of the frequencies; covers the errors of lamp clocks and row clocks


@dataclass
class StripedLamp:
    """A lamp of the map and the blobs whose stripes have its frequency, at most one per frame."""

    id: int
    frequency_hz: float
    blobs: list[Blob] = field(default_factory=list)

    @property
    def measured_hz(self) -> tuple[float, float]:
        """Weighted mean of the measured frequencies and its standard deviation [Hz]."""
        values = np.array([blob.frequency_hz for blob in self.blobs], float)
        weight = np.array([blob.frequency_sigma_hz for blob in self.blobs], float) ** -2
        return float((weight * values).sum() / weight.sum()), float(weight.sum() ** -0.5)


def striped_lamps(frames: Frames, scene: Scene) -> list[StripedLamp]:
    """Lamps of the map that were detected by their frequency, in the order of the map."""
    lamps = [StripedLamp(lamp.id, lamp.frequency_hz) for lamp in scene.lamps if lamp.frequency_hz]
    if not lamps:
        raise ValueError("map: no lamp has a frequency_hz")
    known_hz = np.array([lamp.frequency_hz for lamp in lamps])
    with progress("reading stripes", len(frames.images)) as advance:
        for image in frames.images:
            for blob in detect(image, sensor=scene.sensor):
                if blob.frequency_hz is None:
                    continue
                nearest = int(np.argmin(np.abs(known_hz - blob.frequency_hz)))
                if abs(known_hz[nearest] - blob.frequency_hz) < TOLERANCE * known_hz[nearest]:
                    lamps[nearest].blobs.append(blob.replace(lamp_id=lamps[nearest].id))
            advance()
    return [lamp for lamp in lamps if lamp.blobs]
