# SPDX-License-Identifier: Apache-2.0
"""Radiometry and its calibration: received power, response curves, lamp power and ambient light."""

from ._core import (
    AmbientImage,
    AmbientLight,
    CalibratedLight,
    ChannelResponse,
    LampFlux,
    LampLight,
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
    "AmbientImage", "AmbientLight", "CalibratedLight", "ChannelResponse", "LampFlux", "LampLight", "PowerFit",
    "ReceivedPower", "RecoveredResponse", "ResponseMethod", "aperture_power", "calibrate_ambient", "calibrate_light",
    "dbm", "lambertian_order", "radiance", "radiant_intensity", "recover_response",
]
