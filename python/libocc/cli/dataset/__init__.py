# SPDX-License-Identifier: Apache-2.0
"""Rendered sequences with ground truth for `libocc sequence`, also in the layouts of BOP and COCO."""
