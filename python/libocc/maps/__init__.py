# SPDX-License-Identifier: Apache-2.0
"""What a camera that moves over a plane receives: power, lamps in view, how well its position shows."""

from .compute import PowerMap, power_map
from .plane import Plane, looking_up, plane_of, with_focal_length

__all__ = ["Plane", "PowerMap", "looking_up", "plane_of", "power_map", "with_focal_length"]
