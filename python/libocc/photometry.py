# SPDX-License-Identifier: Apache-2.0
"""Radiometry and its calibration: measured emission, received power, response curves, lamp power and ambient light."""

from ._core import (
    AmbientImage,
    AmbientLight,
    CalibratedLight,
    ChannelResponse,
    EmissionProfile,
    LampFlux,
    LampLight,
    LampTilt,
    OpeningShape,
    PhotometricDistribution,
    PowerFit,
    ReceivedPower,
    RecoveredResponse,
    ResponseMethod,
    aperture_power,
    calibrate_ambient,
    calibrate_light,
    dbm,
    lambertian_order,
    radiance,
    radiant_intensity,
    recover_response,
)

__all__ = [
    "AmbientImage", "AmbientLight", "CalibratedLight", "ChannelResponse", "EmissionProfile", "LampFlux",
    "LampLight", "LampTilt", "OpeningShape", "PhotometricDistribution", "PowerFit", "ReceivedPower",
    "RecoveredResponse", "ResponseMethod", "aperture_power", "calibrate_ambient", "calibrate_light", "dbm",
    "lambertian_order", "radiance", "radiant_intensity", "recover_response",
]
