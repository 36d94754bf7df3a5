# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes from files, read by trimesh."""

from importlib import import_module
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray


def read_mesh(path: str | PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Reads the vertices (n, 3) and triangles (k, 3) of an OBJ, PLY or STL file, in the file's unit.

    Raises: OSError when it cannot be opened; ValueError naming the file when it is not a mesh;
      ImportError without trimesh (`pip install libocc[mesh]`).
    """
    with open(path, "rb"):
        pass  # raises an OSError that names the file
    try:
        trimesh: Any = import_module("trimesh")
    except ImportError as error:
        raise ImportError("reading meshes requires trimesh: pip install libocc[mesh]") from error
    try:
        mesh = trimesh.load(str(path), force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int32)
    except Exception as error:  # the reader of each format raises exceptions of its own
        raise ValueError(f"{path}: cannot be read as a mesh: {error}") from error
    if not len(faces):
        raise ValueError(f"{path}: contains no faces")
    return vertices, faces
