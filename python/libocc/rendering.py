# SPDX-License-Identifier: Apache-2.0
"""Image formation in detail: effects and their plan, colour filters, and the projection of a lamp."""

from ._core import (
    BlobColour,
    Channel,
    EffectPlan,
    Ellipse,
    ExplainedEffect,
    Ghost,
    Mosaic,
    NoiseArea,
    Use,
    log_irradiance_gradient,
    plan_render,
    project_lamp_centre,
    project_rim,
)

__all__ = [
    "BlobColour", "Channel", "EffectPlan", "Ellipse", "ExplainedEffect", "Ghost", "Mosaic", "NoiseArea", "Use",
    "log_irradiance_gradient", "plan_render", "project_lamp_centre", "project_rim",
]
