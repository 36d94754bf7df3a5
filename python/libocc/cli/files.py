# SPDX-License-Identifier: Apache-2.0
"""Files that are written completely or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from .interrupts import temporary_files


@contextmanager
def whole_file(path: str) -> Iterator[IO[bytes]]:
    """Opens a temporary file that replaces `path` when the block ends without error. Raises: OSError naming `path`."""
    folder = Path(path).resolve().parent
    try:
        if Path(path).is_dir():
            raise IsADirectoryError(f"{path}: is a folder")
        handle, name = tempfile.mkstemp(dir=folder, prefix=".libocc-")
    except OSError as error:
        raise OSError(f"{path}: cannot be written: {error.strerror or 'is a folder'}") from error
    temporary_files.add(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())  # otherwise a crash after the renaming can leave an empty file
        os.chmod(name, 0o666 & ~_umask())
        os.replace(name, path)
    except BaseException:
        with suppress(FileNotFoundError):  # Ctrl-C can arrive just after the renaming
            os.unlink(name)
        raise
    finally:
        temporary_files.discard(name)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
