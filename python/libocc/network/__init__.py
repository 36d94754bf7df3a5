# SPDX-License-Identifier: Apache-2.0
"""Photogrammetric networks: bundle adjustment, datum, precision, statistics and start values.

`read_network` reads a network with its tables from files, `adjust` estimates cameras, poses and points, `precision`
gives the covariances in a datum and `network_statistics` the reliability.
"""

from .._core import (
    Adjustment,
    CameraParameter,
    CheckResult,
    CommonFactor,
    Datum,
    DatumKind,
    LeftOut,
    MeasuredPoint,
    Measurement,
    Network,
    NetworkStart,
    NetworkStatistics,
    ParameterStatistics,
    Precision,
    Ray,
    RejectedControl,
    RejectedDistance,
    RejectedObservation,
    Resection,
    ScalePrediction,
    ScaleSource,
    Selection,
    SelectionStep,
    Target,
    TestField,
    TestFieldDesign,
    VarianceComponent,
    VarianceComponents,
    adjust,
    board_network,
    check_points,
    compare_scale,
    format_camera,
    free_parameter_directions,
    free_parameter_value,
    image_residuals_px,
    lamp_network,
    measure_points,
    network_statistics,
    paper_additional_parameters,
    paper_panorama_camera,
    parameter_statistics,
    precision,
    projection_uncertainty,
    resect,
    select_parameters,
    simulate_test_field,
    start_network,
    start_pinhole,
    variance_components,
)
from .files import network_files, read_network
from .importing import Imported, import_network

__all__ = [
    "Adjustment", "CameraParameter", "CheckResult", "CommonFactor", "Datum", "DatumKind", "Imported", "LeftOut",
    "MeasuredPoint", "Measurement", "Network", "NetworkStart", "NetworkStatistics", "ParameterStatistics",
    "Precision", "Ray", "RejectedControl", "RejectedDistance", "RejectedObservation", "Resection",
    "ScalePrediction", "ScaleSource", "Selection", "SelectionStep", "Target", "TestField", "TestFieldDesign",
    "VarianceComponent", "VarianceComponents", "adjust", "board_network", "check_points", "compare_scale",
    "format_camera", "free_parameter_directions", "free_parameter_value", "image_residuals_px", "import_network",
    "lamp_network", "measure_points",
    "network_files", "network_statistics", "paper_additional_parameters", "paper_panorama_camera",
    "parameter_statistics", "precision", "projection_uncertainty", "read_network", "resect",
    "select_parameters", "simulate_test_field", "start_network", "start_pinhole", "variance_components",
]
