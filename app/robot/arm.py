"""The default arm as numbers: names, limits and the file that both MuJoCo and Pinocchio read."""

from pathlib import Path

import numpy as np

ARM_FILE = Path(__file__).with_name("arm.xml")

JOINT_NAMES = tuple(f"joint_{i}" for i in range(1, 8))
FINGER_NAMES = ("finger_left", "finger_right")
N_JOINTS = len(JOINT_NAMES)
N_CTRL = N_JOINTS + 1
"""Seven position servos and one for the grip."""
HAND_SITE = "ee"

HOME_DEGREES = (0.0, 15.0, 0.0, 130.0, 0.0, -55.0, 0.0)
LOW_DEGREES = (-360.0, -128.3, -360.0, 20.0, -360.0, -119.7, -360.0)
HIGH_DEGREES = (360.0, 128.3, 360.0, 147.2, 360.0, 119.7, 360.0)
"""Limits in operation [degrees], inside those of arm.xml.

The elbow (joint 4) never straightens: it costs 1 cm of reach, and the arm cannot be caught in the
singularity there, from which no pull straight back would bring it home.
"""
JOINT_LOW = np.radians(np.array(LOW_DEGREES))  # [rad]
JOINT_HIGH = np.radians(np.array(HIGH_DEGREES))  # [rad]

MAX_VELOCITY = np.array([1.39, 1.39, 1.39, 1.39, 1.22, 1.22, 1.22])  # [rad/s], published
MAX_ACCELERATION = np.array([5.2, 5.2, 5.2, 5.2, 10.0, 10.0, 10.0])  # [rad/s²], published

FINGER_OPEN = 0.0  # [m] travel of each finger
FINGER_CLOSED = 0.05  # [m]
APERTURE = 0.10  # [m] between the pads of the open hand
