# SPDX-License-Identifier: Apache-2.0
"""Images as the bytes of a file, and back."""

import importlib
import io
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._core import encode_image, read_image
from ...yaml_files import suggestion

Pixels = npt.NDArray[Any]
FORMATS = ("png", "pgm", "npy", "exr")


def check_format(name: str) -> None:
    """Raises: ValueError for an unknown one, and for one whose library is not installed."""
    if name not in FORMATS:
        raise ValueError(f"unknown image format {name!r}; {suggestion(name, FORMATS)}")
    if name == "exr":
        _openexr()


def _openexr() -> Any:
    try:
        return importlib.import_module("OpenEXR")
    except ImportError as error:
        raise ValueError("EXR files need: pip install 'libocc[exr]'") from error


def image_bytes(image: Pixels, name: str) -> bytes:
    """PNG and PGM hold 8 or 16 bits as the sensor has them, NPY the array itself, EXR the grey levels
    as 32-bit floats in a channel Y."""
    if name == "npy":
        buffer = io.BytesIO()
        np.save(buffer, image, allow_pickle=False)
        return buffer.getvalue()
    if name == "exr":
        return _exr_bytes(image)
    return encode_image(image, f".{name}")


def _exr_bytes(image: Pixels) -> bytes:
    openexr = _openexr()
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    with tempfile.TemporaryDirectory() as folder:  # the library writes to files only
        path = Path(folder) / "image.exr"
        with openexr.File(header, {"Y": image.astype(np.float32)}) as file:
            file.write(str(path))
        return path.read_bytes()


def load_image(path: Path) -> Pixels:
    """What image_bytes() was given; of an EXR file its floats."""
    if path.suffix == ".npy":
        pixels: Pixels = np.load(path, allow_pickle=False)
        return pixels
    if path.suffix == ".exr":
        with _openexr().File(str(path)) as file:
            return np.array(file.channels()["Y"].pixels)
    return read_image(path)
