# SPDX-License-Identifier: Apache-2.0
"""JSON Schemas of libocc's YAML files, for editors.

The keys come from the lists that the readers use: the fields of the compiled structs, and the tuples of known keys. A
schema checks keys, types and names of choices. Ranges of values, ids, and rules on several keys are checked by libocc.
"""

from . import experiments, others, scenes
from .structs import Schema

SCHEMAS: dict[str, Schema] = {
    "scene": scenes.scene(),
    "camera": scenes.camera_file(),
    "object": scenes.object_file(),
    "network": others.network(),
    "trajectory": others.trajectory(),
    "sweep": others.sweep(),
    "experiment": experiments.experiment(),
    "route": experiments.route_file(),
    "hard-case": others.hard_case(),
}
