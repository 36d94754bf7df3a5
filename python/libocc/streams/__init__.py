# SPDX-License-Identifier: Apache-2.0
"""Positions live, from frames as they come: folders, videos, cameras and ROS bags in; lines of text
or JSON, TUM trajectories, ROS bags and Rerun recordings out."""
