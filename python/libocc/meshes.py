# SPDX-License-Identifier: Apache-2.0
"""Bodies from mesh files, through trimesh."""

from importlib import import_module
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray


def read_mesh(path: str | PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (n, 3) and triangles (k, 3) of an OBJ, PLY or STL file, in the file's unit.

    Raises: OSError when it cannot be opened; ValueError naming the file when it is no mesh;
      ImportError without trimesh (`pip install libocc[mesh]`).
    """
    with open(path, "rb"):
        pass  # OSError names the file
    try:
        trimesh: Any = import_module("trimesh")
    except ImportError as error:
        raise ImportError("meshes are read by trimesh: pip install libocc[mesh]") from error
    try:
        mesh = trimesh.load(str(path), force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int32)
    except Exception as error:  # each format's reader has its own
        raise ValueError(f"{path}: is no mesh that can be read: {error}") from error
    if not len(faces):
        raise ValueError(f"{path}: holds no faces")
    return vertices, faces
