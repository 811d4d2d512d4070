"""The frames of paper 4, Figs 2 and 3, for drawings; and what a slider asks for about the elbow."""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot.ik.base_sharing import anchor
from tutorialbot.ik.singularity_consistent import SphericalArm, elbow_peak_rate, time_scale
from tutorialbot.ik.spherical_rates import triangle, wrist_axes
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT


@dataclass(frozen=True)
class ArmFrames:
    """Fig. 2, in the anchor's axes or, given a base, in those of the world.

    points (5, 3): anchor, shoulder, elbow, wrist, tip [m]; joints (7, 3): where they are [m]; axes (7, 3): unit vectors
    along them; wrist_frame: W, z from shoulder to wrist, at the wrist; tip: its pose; r [m]: the length of the virtual
    prismatic joint; alpha, beta [rad]: from the upper arm to z of W, and from there to the lower arm.
    """

    points: np.ndarray
    joints: np.ndarray
    axes: np.ndarray
    wrist_frame: pin.SE3
    tip: pin.SE3
    r: float
    alpha: float
    beta: float


def arm_frames(
    arm: SphericalArm, q: np.ndarray, base: np.ndarray | None = None, mount: float = ANCHOR_HEIGHT
) -> ArmFrames:
    """Return the frames of Fig. 2 for q (7,) [rad]; base (3,): x, y, yaw of the mobile base, if it is on one."""
    angles = arm.checked(q)
    there = pin.SE3.Identity() if base is None else anchor(base, mount)
    tip = there * arm.forward(q)
    placed = [there * arm.data.oMi[i] for i in range(1, 8)]
    axes = [pose.rotation[:, 2 if kind == "z" else 1] for pose, kind in zip(placed, "zyzyzyz", strict=True)]
    joints = np.array([pose.translation for pose in placed])
    s, c = [*map(math.sin, angles)], [*map(math.cos, angles)]
    sides = triangle(s[3], c[3], arm.upper, arm.lower)
    alpha = math.atan2(sides[1], sides[2])
    turn = there.rotation @ np.array(wrist_axes(s, c, sides)).T
    points = np.array([there.translation, joints[0], joints[3], joints[4], tip.translation])
    return ArmFrames(points, joints, np.array(axes), pin.SE3(turn, joints[4]), tip, sides[0], alpha, angles[3] - alpha)


@dataclass(frozen=True)
class RobotFrames:
    """Fig. 3, in the world: F_0, F_mb on the floor under the base's centre, F_a where the arm begins, and the arm."""

    world: pin.SE3
    mobile_base: pin.SE3
    arm_anchor: pin.SE3
    arm: ArmFrames


def robot_frames(arm: SphericalArm, base: np.ndarray, q: np.ndarray, mount: float = ANCHOR_HEIGHT) -> RobotFrames:
    """Return the frames of Fig. 3 for the base at (x, y, yaw) [m, m, rad] and q (7,) [rad]."""
    return RobotFrames(pin.SE3.Identity(), anchor(base, 0.0), anchor(base, mount), arm_frames(arm, q, base, mount))


@dataclass(frozen=True)
class ElbowRate:
    """What eq (2) makes of the elbow at one angle: scale b, rate [rad/s] = qdot4, the plain rate without b [rad/s], the
    peak [rad/s] over all angles by the closed form, epsilon [rad], and whether |q4| is below it.
    """

    scale: float
    rate: float
    plain_rate: float
    peak: float
    epsilon: float
    inside: bool


def elbow_rate(arm: SphericalArm, q4: float, speed: float = 0.1, n: int = 2, scaling: str = "sine") -> ElbowRate:
    """Return b and the elbow's rate at q4 [rad] when the wrist is asked for `speed` [m/s] straight out."""
    b, b_over_sine = time_scale(q4, n, scaling)
    r, *_ = triangle(math.sin(q4), math.cos(q4), arm.upper, arm.lower)
    per_sine = -r / (arm.upper * arm.lower) * speed
    plain = per_sine / math.sin(q4) if math.sin(q4) else math.copysign(math.inf, per_sine)
    epsilon = math.pi / 2.0 ** (n + 1)
    return ElbowRate(b, per_sine * b_over_sine, plain, elbow_peak_rate(arm, abs(speed), n, scaling), epsilon,
                     abs(q4) < epsilon)  # fmt: skip
