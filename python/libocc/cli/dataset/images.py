# SPDX-License-Identifier: Apache-2.0
"""Encoding and decoding of images in the formats PNG, PGM, NPY and EXR."""

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
    """Raises ValueError for an unknown format, or if the library of the format is not installed."""
    if name not in FORMATS:
        raise ValueError(f"unknown image format {name!r}; {suggestion(name, FORMATS)}")
    if name == "exr":
        _openexr()


def _openexr() -> Any:
    try:
        return importlib.import_module("OpenEXR")
    except ImportError as error:
        raise ValueError("EXR files require: pip install 'libocc[exr]'") from error


def image_bytes(image: Pixels, name: str) -> bytes:
    """Encodes an image: PNG and PGM with 8 or 16 bits, NPY as the array, EXR as 32-bit floats in the channel Y."""
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
    with tempfile.TemporaryDirectory() as folder:  # the library writes only to files
        path = Path(folder) / "image.exr"
        with openexr.File(header, {"Y": image.astype(np.float32)}) as file:
            file.write(str(path))
        return path.read_bytes()


def load_image(path: Path) -> Pixels:
    """Reads an image written by image_bytes(); an EXR file gives floats."""
    if path.suffix == ".npy":
        pixels: Pixels = np.load(path, allow_pickle=False)
        return pixels
    if path.suffix == ".exr":
        with _openexr().File(str(path)) as file:
            return np.array(file.channels()["Y"].pixels)
    return read_image(path)
