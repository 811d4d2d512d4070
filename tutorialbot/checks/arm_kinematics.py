"""Exercises 2 to 4 of notebook 2: quaternions by the thousand, the Jacobian, and the tilt of a hand.

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tutorialbot.checks.counting import lines_run
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, agree, numbers
from tutorialbot.ik.arm7 import ARM
from tutorialbot.seeding import make_rng

SEED = 2
FEW, MANY, SLACK = 40, 2000, 200  # vectors, and steps of Python by which many may differ from few


def random_units(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Return vectors of length 1 in directions drawn by chance."""
    vectors = rng.standard_normal(shape)
    return vectors / np.sqrt(np.sum(vectors * vectors, axis=-1, keepdims=True))


# --- 2 ----------------------------------------------------------------------------------------------------------------
def _turned(quaternions: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (m, 3) turned by the matrices of the k quaternions, the last one first."""
    found = np.broadcast_to(vectors, (max(len(quaternions), len(vectors)), 3))
    for turn in reversed(range(quaternions.shape[1])):
        matrices = Rotation.from_quat(np.roll(quaternions[:, turn], -1, axis=-1)).as_matrix()
        found = np.sum(matrices * found[:, None, :], axis=-1)
    return found


def _judge_turn(student: Student) -> None:
    rng = make_rng(SEED, 2)
    half = np.sqrt(0.5)
    quarter = np.array([[[half, 0.0, 0.0, half]]])  # about z

    def trial(check: str, reason: str, quaternions: np.ndarray, vectors: np.ndarray) -> None:
        inputs = (quaternions, vectors)
        expected = _turned(*inputs)
        agree(check, numbers(student(*inputs), expected.shape, inputs, reason), expected, inputs, reason, 1e-9)

    reason = "A quarter turn about z brings the x axis to y: Q v Q*, with w first and the conjugate behind."
    trial("one turn", reason, quarter, np.array([[1.0, 0.0, 0.0]]))
    reason = "Each vector is turned by the quaternion in its own row."
    for n in (2, 5):
        trial("a turn for each", reason, random_units(rng, n, 1, 4), rng.uniform(-1.0, 1.0, (n, 3)))
    reason = "Q = q_1 q_2 ... q_k: each turn is meant about axes that the ones before it have turned already."
    for k in (2, 3, 7):
        trial("order of the product", reason, random_units(rng, 6, k, 4), rng.uniform(-1.0, 1.0, (6, 3)))
    reason = "No number of vectors or turns is special: neither 3 nor 4 of them, and none is an empty answer."
    for n, k in ((1, 4), (3, 3), (4, 4), (4, 1), (3, 4), (0, 2)):
        trial("any shape", reason, random_units(rng, n, k, 4), rng.uniform(-1.0, 1.0, (n, 3)))
    reason = "One posture may turn many points, and many postures one point: the axis of length 1 is stretched."
    for n, m in ((1, 6), (6, 1)):
        trial("one for all", reason, random_units(rng, n, 3, 4), rng.uniform(-1.0, 1.0, (m, 3)))
    steps = []
    for n in (FEW, MANY):
        inputs = random_units(rng, n, 2, 4), rng.uniform(-1.0, 1.0, (n, 3))
        answer, count = lines_run(lambda inputs=inputs: student(*inputs))
        agree("a turn for each", numbers(answer, (n, 3), inputs), _turned(*inputs), inputs, reason, 1e-9)
        steps.append(count)
    if steps[1] > steps[0] + SLACK:
        raise Wrong(
            "all at once",
            f"{FEW} vectors took {steps[0]} steps of Python, {MANY} took {steps[1]}: somewhere a loop runs over the"
            " vectors. A population has 300 members in 200 generations; only a loop over the k turns is affordable.",
        )


turn_all = Exercise(
    "turn_all",
    "turn many vectors by many products of quaternions at once, without a loop over the vectors.",
    (
        "Hamilton's product needs nothing but sums and products of the four components, and these may be arrays:"
        " w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3].",
        "First multiply the k quaternions of each row, from the first to the last: a loop over k, never over n."
        " `np.stack([...], axis=-1)` puts four arrays together.",
        "v becomes the quaternion (0, v) by a column of zeros; then Q v Q*. numpy stretches an axis of length 1 by"
        " itself, if nothing in your lines asks for the same n on both sides.",
    ),
    _judge_turn,
    limit=30.0,
)


# --- 3 ----------------------------------------------------------------------------------------------------------------
def jacobian(q: np.ndarray, axes: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return (6, n) by the product rule: a product of 4 x 4 matrices, in which one factor at a time is derived."""

    def skew(v: np.ndarray) -> np.ndarray:
        return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])

    def step(rotation: np.ndarray, offset: np.ndarray, corner: float) -> np.ndarray:
        return np.block([[rotation, rotation @ offset[:, None]], [np.zeros((1, 3)), np.full((1, 1), corner)]])

    def product(derived: int | None) -> np.ndarray:
        found = step(np.eye(3), offsets[0], 1.0)
        for i, (angle, axis, offset) in enumerate(zip(q, axes, offsets[1:], strict=True)):
            turn = Rotation.from_rotvec(angle * axis).as_matrix()
            found = found @ step(skew(axis) @ turn if i == derived else turn, offset, float(i != derived))
        return found

    rotation, columns = product(None)[:3, :3], []
    for i in range(len(q)):
        change = product(i)
        spin = change[:3, :3] @ rotation.T  # skew
        columns.append([*change[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]])
    return np.transpose(columns)


def _judge_jacobian(student: Student) -> None:
    rng = make_rng(SEED, 3)

    def trial(check: str, reason: str, q, axes, offsets, tolerance: float = 1e-4, spin: str = "angular velocity"):
        inputs = tuple(np.asarray(part, dtype=float) for part in (q, axes, offsets))
        expected = jacobian(*inputs)
        answer = numbers(student(*inputs), expected.shape, inputs, reason)
        agree(check, answer[:3], expected[:3], inputs, reason, tolerance)
        told = "The hand's angular velocity is the sum of all axes, as they stand now, times the joints' rates."
        agree(spin, answer[3:], expected[3:], inputs, told if spin != check else reason, tolerance)

    reason = "A single joint moves the tip by axis x lever, the lever from the joint (not from the abdomen) to the tip."
    for turn in (0.0, *rng.uniform(-3.0, 3.0, 3)):
        trial("one joint", reason, [turn], [[0.0, 0.0, 1.0]], [[0.0, 0.2, 0.4], [0.3, 0.0, 0.1]])
    reason = "Axes that stay parallel: each joint's lever reaches from that joint to the tip, over all links between."
    for n in (2, 3, 5):
        trial("lever arm", reason, rng.uniform(-1.0, 1.0, n), [[0.0, 1.0, 0.0]] * n, rng.uniform(-0.4, 0.4, (n + 1, 3)))
    reason = "An axis stands still in the link before it, and turns with all joints before it."
    for n in (2, 3, 4, 7):  # seven too: another arm than the paper's, with links everywhere, and more than a turn
        inputs = rng.uniform(-7.0, 7.0, n), random_units(rng, n, 3), rng.uniform(-0.4, 0.4, (n + 1, 3))
        trial("axes turn along", reason, *inputs)
    reason = "The seven-axis arm: three axes in the shoulder, three in the wrist, with no link between them."
    for q in rng.uniform(ARM.lower, ARM.upper, (10, 7)):
        trial("seven axes", reason, q, ARM.axes, ARM.offsets)
    reason = "Right to some digits, as small steps give it. By axes and levers it is exact to 1e-12, and cheaper."
    for q in rng.uniform(ARM.lower, ARM.upper, (10, 7)):
        trial("no small steps", reason, q, ARM.axes, ARM.offsets, 1e-12, "no small steps")


tip_jacobian = Exercise(
    "tip_jacobian",
    "the Jacobian of any arm of rotary joints by axes and levers, exactly.",
    (
        "Walk along the arm once, as forward kinematics does, and note for each joint where it is and where its axis"
        " points, both in the abdomen's frame.",
        "`scipy.spatial.transform.Rotation.from_rotvec(angle * axis)` turns vectors with `.apply` and chains with `*`."
        " The joint's position: the sum of all links before it, each turned by all joints before it.",
        "Column i: np.cross(axis_i, tip - point_i) on top, axis_i below. The tip is only known at the end of the walk.",
    ),
    _judge_jacobian,
)


# --- 4 ----------------------------------------------------------------------------------------------------------------
def composed(tilt: np.ndarray) -> np.ndarray:
    """Return Ry(pitch) Rx(roll) Rz(yaw) (3, 3), entry by entry."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(tilt), np.cos(tilt)
    return np.array([
        [cp * cy + sp * sr * sy, sp * sr * cy - cp * sy, sp * cr],
        [cr * sy, cr * cy, -sr],
        [cp * sr * sy - sp * cy, sp * sy + cp * sr * cy, cp * cr],
    ])  # fmt: skip


def _apart(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return `wanted` shifted by whole turns to next to `found`."""
    return wanted + 2.0 * np.pi * np.rint((found - wanted) / (2.0 * np.pi))


def _judge_tilts(student: Student) -> None:
    rng = make_rng(SEED, 4)
    right, full = np.pi / 2, np.pi

    def trial(check: str, reason: str, tilt) -> None:
        tilt = np.asarray(tilt, dtype=float)
        inputs = (composed(tilt),)
        first, second = numbers(student(*inputs), (2, 3), inputs, reason)
        agree(check, first, _apart(first, tilt), inputs, reason)
        other = np.array([full - tilt[0], tilt[1] + full, tilt[2] + full])
        told = "The second triple is another name of the same attitude: half a turn of pitch, and of yaw, and roll?"
        agree("the other triple", second, _apart(second, other), inputs, told)

    for axis, name in enumerate(("roll", "pitch", "yaw")):
        reason = f"A {name} alone, about {'xyz'[axis]}: the others are zero, and mind its sign."
        for angle in rng.uniform(-1.2, 1.2, 4):
            trial("one axis", reason, angle * np.eye(3)[axis])
    reason = "R = Ry(pitch) Rx(roll) Rz(yaw): another order gives other angles as soon as two of them are not zero."
    for _ in range(8):
        trial("order of the turns", reason, rng.uniform(-1.2, 1.2, 3))
    reason = "A quotient cannot tell an angle from the opposite one: look at both signs. Roll is within 90 degrees."
    for tilt in rng.uniform([-1.5, -full, -full], [1.5, full, full], (20, 3)):
        trial("every quadrant", reason, tilt)
    reason = "Roll is near 90 degrees, not at it: pitch and yaw are two still, though cos(roll) is small."
    for tilt in rng.uniform([0.01, -full, -full], [0.05, full, full], (10, 3)):
        trial("near gimbal lock", reason, [rng.choice([-1.0, 1.0]) * (right - tilt[0]), *tilt[1:]])
    reason = "Table 1 asks for a pitch of -90 degrees: nothing special in this order, singular in the usual one."
    for roll, pitch, yaw in ([0.0, 0.0, 0.0], *rng.uniform(-0.02, 0.02, (3, 3)), *rng.uniform(-1.0, 1.0, (3, 3))):
        trial("pitch of -90 degrees", reason, [roll, 0.02 * pitch - right, yaw])
    reason = "At a roll of 90 degrees pitch and yaw turn about one axis: any pair that composes to R will do."
    for roll, pitch, yaw in rng.uniform(-full, full, (12, 3)):
        for beyond in (0.0, 1e-15):  # which rounding may bring
            matrix = composed(np.array([np.copysign(right, roll), pitch, yaw]))
            matrix[1] = 0.0, 0.0, np.copysign(1.0 + beyond, -roll)
            matrix[[0, 2], 2] = 0.0
            for triple in numbers(student(matrix), (2, 3), (matrix,), reason):
                told = f"{reason} Your (roll, pitch, yaw) = {show(triple)} compose to another matrix{case((matrix,))}"
                agree("gimbal lock", composed(triple), matrix, (), told)


both_tilts = Exercise(
    "both_tilts",
    "the two triples (roll, pitch, yaw) that name an attitude, pitch first.",
    (
        "Multiply Ry Rx Rz out on paper. One row and one column of R hold products of two factors only.",
        "R[1, 2] = -sin(roll), R[0, 2] = sin(pitch) cos(roll), R[2, 2] = cos(pitch) cos(roll); R[1, 0] and R[1, 1]"
        " tell yaw the same way. `np.arctan2` of both; clip what goes into arcsin.",
        "The other triple is (pi - roll, pitch + pi, yaw + pi). When R[1, 0] and R[1, 1] both vanish, yaw may be 0:"
        " then pitch is the arctan2 of -R[2, 0] and R[0, 0].",
    ),
    _judge_tilts,
)
