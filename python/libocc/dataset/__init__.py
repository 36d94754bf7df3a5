# SPDX-License-Identifier: Apache-2.0
"""Sequences: a trajectory rendered to frames with their truth, in the layouts of BOP and COCO too."""
