# SPDX-License-Identifier: Apache-2.0
"""Result folder of a run that can be continued.

Each file is written completely or not at all. `libocc.json` records the settings of the run, so that only a run with
the same settings continues in the folder.
"""

import csv
import hashlib
import io
import json
from collections.abc import Generator, Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

from .files import whole_file
from .progress import Advance

SETTINGS = "libocc.json"


def json_bytes(data: Any) -> bytes:
    """JSON; equal data give equal bytes. Raises: ValueError when the data contain NaN or infinity."""
    return (json.dumps(data, allow_nan=False) + "\n").encode()


def content_hash(content: bytes) -> str:
    """Short hash of a file's content, for the settings of a run."""
    return hashlib.sha256(content).hexdigest()[:16]


def table(rows: Iterable[dict[str, Any]]) -> bytes:
    """CSV table; numbers with all digits, lists as JSON, None as an empty cell."""
    text = io.StringIO()
    writer = None
    for row in rows:
        if writer is None:
            writer = csv.DictWriter(text, list(row), lineterminator="\n")
            writer.writeheader()
        writer.writerow({k: json.dumps(v) if isinstance(v, (list, dict)) else v for k, v in row.items()})
    return text.getvalue().encode()


class ResultFolder:
    """A folder with the results of one run.

    settings: plain data that determine the result; the first key is its kind.
    Raises: OSError when the folder cannot be created or written; ValueError when it contains other files, or
      the result of other settings.
    """

    def __init__(self, path: str, settings: dict[str, Any]):
        self.path = Path(path)
        self.written = 0
        kept = self.path / SETTINGS
        if kept.exists():
            self._compare(json.loads(kept.read_text()), settings)
            for left in self.path.rglob(".libocc-*"):
                left.unlink()
            return
        if self.path.is_dir() and any(self.path.iterdir()):
            raise ValueError(f"{path}: is not empty and has no results of libocc; use another folder")
        self.write(SETTINGS, json_bytes(settings))

    def keep(self, results: Generator[tuple[Any, dict[str, bytes]], None, None], advance: Advance) -> bool:
        """Writes the files of each job when it is done; returns True after Ctrl-C. Raises: OSError."""
        try:
            with closing(results):
                for _, files in results:
                    for name, content in files.items():
                        self.write(name, content)
                    advance()
        except KeyboardInterrupt:
            return True
        return False

    def _compare(self, before: dict[str, Any], now: dict[str, Any]) -> None:
        changed = [key for key in {**before, **now} if before.get(key) != now.get(key)]
        if changed:
            texts = [f"{key} was {before.get(key)}, is {now.get(key)}" for key in changed]
            raise ValueError(
                f"{self.path}: contains the result of other settings: "
                f"{'; '.join(texts)}. Use another folder or delete it"
            )

    def has(self, name: str) -> bool:
        return (self.path / name).is_file()

    def read_json(self, name: str) -> Any:
        return json.loads((self.path / name).read_text())

    def names(self, folder: str, ending: str) -> list[str]:
        """Sorted names, without the ending, of the files in a folder."""
        return sorted(path.stem for path in (self.path / folder).glob(f"[!.]*{ending}"))

    def write(self, name: str, content: bytes) -> None:
        """Writes a file. Raises: OSError naming the file."""
        path = self.path / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(str(path)) as file:
                file.write(content)
                file.flush()
        except OSError as error:
            reason = error.strerror or str(error)
            raise OSError(
                f"{path}: cannot be written: {reason.removeprefix(f'{path}: cannot be written: ')}; "
                "all files written so far are complete: the same command continues from there"
            ) from error
        self.written += 1
