# SPDX-License-Identifier: Apache-2.0
"""Runs the command line with `python -m libocc.cli`."""

from . import main

main(prog_name="libocc")
