# SPDX-License-Identifier: Apache-2.0
"""Objects known by points: recognition, value of each point for localisation, and distance by headlights."""

from ._core import (
    DetectablePoint,
    HeadlightDistance,
    LocalisationValue,
    Object,
    ObjectMatch,
    ObjectPoint,
    PointValue,
    RecognisedObject,
    Recognition,
    RoadHeights,
    VehiclePose,
    VehiclePoses,
    detectable_points,
    headlight_distance,
    identify_object,
    localisation_value,
    recognise,
    vehicle_poses,
    views_around,
)
from .meshes import read_mesh

__all__ = [
    "DetectablePoint", "HeadlightDistance", "LocalisationValue", "Object", "ObjectMatch", "ObjectPoint", "PointValue",
    "RecognisedObject", "Recognition", "RoadHeights", "VehiclePose", "VehiclePoses", "detectable_points",
    "headlight_distance", "identify_object", "localisation_value", "read_mesh", "recognise", "vehicle_poses",
    "views_around",
]
