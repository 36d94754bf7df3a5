# SPDX-License-Identifier: Apache-2.0
"""Settings of the documentation site, which tools/docs builds."""

import inspect
import re
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS / "_ext"))

import generated_pages  # noqa: E402
from plain_text import to_rst  # noqa: E402
from signatures import shorten  # noqa: E402

project = "libocc"
author = "The libocc contributors"
copyright = "The libocc contributors, Apache License 2.0"
found = re.search(r"project\(libocc VERSION ([0-9.]+)", (DOCS.parent / "CMakeLists.txt").read_text())
release = version = found.group(1) if found else ""

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_click", "sphinx_copybutton"]
exclude_patterns = ["_ext", "pictures"]
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_title = f"libocc {release}"
templates_path: list[str] = []
pygments_style = "friendly"
smartquotes = False
maximum_signature_line_length = 88
toc_object_entries = False  # with them every page copies the names of all members: three times the time

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]
copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True

autodoc_member_order = "bysource"
autodoc_docstring_signature = True


def plain_docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text."""
    lines[:] = to_rst(lines)


def short_signature(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Types of signatures by their short names."""
    return shorten(signature), shorten(returns)


def plain_help(app: Any, ctx: Any, lines: list[str]) -> None:
    """Help texts of commands are plain text."""
    lines[:] = to_rst(inspect.cleandoc(ctx.command.help or "").splitlines())


def setup(app: Any) -> None:
    generated_pages.write_all(DOCS)
    app.connect("autodoc-process-docstring", plain_docstring)
    app.connect("autodoc-process-signature", short_signature)
    app.connect("sphinx-click-process-description", plain_help)
