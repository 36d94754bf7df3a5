# SPDX-License-Identifier: Apache-2.0
"""Names and modules of version 0.1 that have moved: usable for one version with a DeprecationWarning."""

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

# Submodules that received names of `libocc`, in the order in which they are searched.
NEW_HOMES = (
    "network", "guide", "codes", "smoothing", "targets", "photometry", "objects", "pose", "rendering", "bench",
)

# Names that were renamed when they moved: former name -> submodule and present name.
RENAMED = {"OdometryLie": ("guide", "OdometryFault")}

# Former path below `libocc` -> present path. The longest matching prefix applies.
MODULES = {
    "calibration": "cli.calibration",
    "calibration.network_file": "network.files",
    "calibration.tables": "network.tables",
    "commands": "cli.commands",
    "dataset": "cli.dataset",
    "exif": "cli.exif",
    "files": "cli.files",
    "guide.animation": "cli.guide.animation",
    "guide.pictures": "cli.guide.pictures",
    "guide.runs": "cli.guide.runs",
    "guide.summary": "cli.guide.summary",
    "hard_cases": "cli.hard_cases",
    "ladder": "cli.ladder",
    "object_plot": "cli.object_plot",
    "overlay": "cli.overlay",
    "pose_options": "cli.pose_options",
    "poses": "cli.poses",
    "prior_options": "cli.prior_options",
    "progress": "cli.progress",
    "report": "cli.report",
    "response_plot": "cli.response_plot",
    "result_folder": "cli.result_folder",
    "sequence_frames": "cli.sequence_frames",
    "streams": "cli.position",
    "stripe_codes": "cli.stripe_codes",
    "suggest": "yaml_files",
    "sweep": "cli.sweep",
    "tags_plot": "cli.tags_plot",
    "workers": "cli.workers",
}


def find_name(name: str) -> Any:
    """Attribute `name` that was in `libocc` and is now in a submodule. Raises: AttributeError when there is none."""
    if name in RENAMED:
        place, present = RENAMED[name]
        warnings.warn(f"libocc.{name} is now libocc.{place}.{present}", DeprecationWarning, stacklevel=3)
        return getattr(import_module(f"libocc.{place}"), present)
    if not name.startswith("_"):
        for place in NEW_HOMES:
            module = import_module(f"libocc.{place}")
            if name in module.__all__:
                warnings.warn(f"libocc.{name} has moved to libocc.{place}.{name}", DeprecationWarning, stacklevel=3)
                return getattr(module, name)
    raise AttributeError(f"module 'libocc' has no attribute {name!r}", name=name, obj=sys.modules["libocc"])


def present_path(path: str) -> str | None:
    """Present path of the module that was at `path` (both below `libocc`); None if it did not move."""
    parts = path.split(".")
    for count in range(len(parts), 0, -1):
        present = MODULES.get(".".join(parts[:count]))
        if present is not None:
            return ".".join([present, *parts[count:]])
    return None


class _Alias(Loader):
    """Loads a module whose attributes are those of the module at the present path."""

    def __init__(self, present: str):
        self._present = present

    def create_module(self, spec: ModuleSpec) -> None:
        return None  # the import system creates an empty module

    def exec_module(self, module: ModuleType) -> None:
        present = import_module(self._present)
        module.__doc__ = present.__doc__
        module.__dict__["__getattr__"] = lambda name: getattr(present, name)


class MovedModules(MetaPathFinder):
    """Finds former module paths after all other finders have failed."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        package, _, rest = fullname.partition(".")
        present = present_path(rest) if package == "libocc" else None
        if present is None:
            return None
        warnings.warn(f"{fullname} has moved to libocc.{present}", DeprecationWarning, stacklevel=2)
        return ModuleSpec(fullname, _Alias(f"libocc.{present}"), is_package=True)


def install() -> None:
    """Registers the finder once per process."""
    if not any(isinstance(finder, MovedModules) for finder in sys.meta_path):
        sys.meta_path.append(MovedModules())
