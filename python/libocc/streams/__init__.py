# SPDX-License-Identifier: Apache-2.0
"""Sources of frames: folders of images, videos, cameras and ROS bags."""
