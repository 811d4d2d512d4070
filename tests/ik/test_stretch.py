"""Paths through the stretched arm: pass, reflect, stall; the saddle; the rule for n; peers; the positive feedback."""

import math

import numpy as np
import pytest

from tutorialbot.errors import InvalidValue, TutorialbotError
from tutorialbot.ik import singular_peers as peers
from tutorialbot.ik.phase_portrait import eigenvalue, line_portrait, portrait, rates, trace
from tutorialbot.ik.singularity_consistent import SphericalArm, elbow_peak_rate
from tutorialbot.ik.stretch import duration, follow, in_time, place_in_time, singularity_consistent, solvers, table
from tutorialbot.ik.stretch_paths import StretchPath, arc, classify, five_paths, radial, references, release, start
from tutorialbot.seeding import make_rng

ARM = SphericalArm()


def run(path, n=2, **options):
    return follow(ARM, path, singularity_consistent(n), **options)


@pytest.mark.parametrize("path", [*five_paths(ARM), arc(ARM, 0.001)], ids=lambda path: path.name)
def test_a_path_is_what_its_equations_say(path):
    q = start(ARM, path)
    tip, _ = references(ARM, path, q)
    np.testing.assert_allclose(tip(0.0)[0], ARM.forward(q).translation, atol=1e-12)
    h = 1e-6
    for s in np.linspace(0.01, path.length - 0.01, 7).tolist():
        np.testing.assert_allclose((tip(s + h)[0] - tip(s - h)[0]) / (2 * h), tip(s)[1], atol=1e-8)
        assert np.linalg.norm(tip(s)[1]) == pytest.approx(1.0)
    assert path.distance(0.0)[0] < ARM.reach


def test_paths_are_classified_by_their_distance():
    assert [classify(ARM, path) for path in five_paths(ARM)] == ["reflects"] * 3 + ["stalls", "reflects"]
    assert classify(ARM, arc(ARM, 0.001)) == "passes" == classify(ARM, radial(ARM, run_up=0.2, beyond=0.0).__class__(
        "short", "line", (0.5, 0.0), (1.0, 0.0), 0.1, returns=True))  # fmt: skip


@pytest.mark.parametrize("n", [2, 3])
def test_a_line_through_the_edge_reflects_with_the_elbow_flipped(n):
    for path in (radial(ARM), radial(ARM, 0.02), release(ARM)):
        found = run(path, n)
        assert (found.outcome, found.flipped) == ("turned back", True)
        top = int(np.argmax(found.s))
        assert abs(found.q[top, 3]) < 0.02 and 0 < top < len(found.s) - 1
        assert found.deviation.max() < 2e-4
        assert np.rad2deg(found.direction_error.max()) < 1e-5
        assert found.scale[0] > 0.0 > found.scale[-1]
        assert np.abs(found.qdot[:, 3]).max() < 1.05 * elbow_peak_rate(ARM, 0.1, n)


def test_the_way_out_and_back_takes_little_longer_than_in_time():
    assert run(radial(ARM), 3).times[-1] == pytest.approx(3.0, rel=0.03)


def test_the_measured_peak_is_the_closed_form_s_within_5_percent():
    for n in (1, 2, 3, 4):
        found = run(radial(ARM), n)
        assert np.abs(found.qdot[:, 3]).max() == pytest.approx(elbow_peak_rate(ARM, 0.1, n), rel=0.05)


def test_inside_it_passes_touching_it_stalls_outside_it_reflects():
    passed, stalled, reflected = (run(arc(ARM, margin)) for margin in (0.001, 0.0, -0.002))
    assert (passed.outcome, passed.arrived, passed.flipped) == ("to the end", True, False)
    assert (stalled.outcome, stalled.arrived) == ("stalled", False)
    assert abs(stalled.s[-1] - 0.25) < 0.01
    assert (reflected.outcome, reflected.flipped) == ("turned back", True)


def test_a_path_that_turns_within_reach_is_turned_and_ends_where_it_began():
    path = type(radial(ARM))("within", "line", (0.5, 0.0), (1.0, 0.0), 0.1, returns=True)
    found = run(path)
    assert (found.outcome, found.arrived, found.flipped) == ("turned back", True, False)
    assert found.s.max() == pytest.approx(0.1, abs=1e-3)


def test_it_works_from_the_other_elbow_too():
    found = run(radial(ARM), q0=start(ARM, radial(ARM), -1))
    assert (found.outcome, found.flipped) == ("turned back", True)
    assert found.deviation.max() < 5e-4 and found.scale[0] < 0.0


def test_feedback_by_b_drives_the_tip_away_once_the_elbow_has_flipped():
    path = radial(ARM)
    good, bad = (run(path, 3, gain=20.0, feedback=feedback) for feedback in ("|b|", "b"))
    assert bad.deviation.max() > 20 * good.deviation.max()


def test_the_error_of_held_rates_shrinks_with_the_step():
    coarse, fine = (run(release(ARM), gain=0.01, dt=dt).deviation.max() for dt in (4e-3, 1e-3))
    assert coarse > 3.0 * fine


def test_the_saddle_has_the_eigenvalues_of_the_formula():
    for n, speed, radius in ((2, 0.1, 0.45), (3, 0.2, 0.3)):
        path, h = arc(ARM, 0.0, radius, 0.1), 1e-6
        columns = [
            (np.array(rates(ARM, path, h * a, 0.1 + h * b, speed, n)) - rates(ARM, path, -h * a, 0.1 - h * b, speed, n))
            / (2 * h)
            for a, b in ((1, 0), (0, 1))
        ]
        found = np.sort(np.linalg.eigvals(np.column_stack(columns)).real)
        expected = 2**n * speed * math.sqrt(2.0 * (1.0 / radius - 1.0 / 0.7) / 0.35)
        np.testing.assert_allclose(found, [-expected, expected], rtol=1e-4)
        assert eigenvalue(ARM, radius, speed, n) == pytest.approx(expected)


def test_the_portrait_s_paths_do_what_is_predicted():
    data = portrait(ARM, points=5)
    passes, stalls, reflects = data.paths
    assert [path.outcome for path in data.paths] == ["passes", "stalls", "reflects"]
    assert passes.s[-1] > 0.1 and passes.q4.min() > 0.0
    assert reflects.s[-1] < -0.1 and reflects.q4[-1] < 0.0
    assert abs(stalls.s[-1]) < 0.01 and abs(stalls.q4[-1]) < 0.02
    assert data.q4_rate.shape == data.s_rate.shape == (5, 5)
    assert math.isnan(line_portrait(ARM, points=5).saddle)


def test_the_plane_is_the_whole_arm_s_motion():
    path = arc(ARM, 0.005)
    plane, whole = trace(ARM, path, n=2), run(path, dt=1e-3)
    there = np.interp(plane.s[::50], whole.s, whole.q[:, 3])
    np.testing.assert_allclose(plane.q4[::50], there, atol=2e-3)


def test_the_reference_of_the_others_goes_there_and_back():
    path = radial(ARM)
    assert place_in_time(path, 0.1) == (0.1, 1.0)
    assert place_in_time(path, 0.2) == (pytest.approx(0.1), -1.0)
    assert place_in_time(path, 0.4) == (0.0, 0.0)
    assert place_in_time(arc(ARM), 1.0) == (0.5, 0.0)
    assert duration(path, 0.1) == pytest.approx(3.0) and duration(arc(ARM), 0.1) == 5.0


def test_the_table_has_a_row_a_path_and_method_and_says_what_is_lost():
    rows = {(row["path"], row["method"]): row for row in table(dt=4e-3)}
    assert len(rows) == 5 * len(solvers())
    names = [path.name for path in five_paths(ARM)]
    ours = "singularity-consistent n=2"
    assert all(rows[name, ours]["direction_error"] < 1e-4 for name in names)
    assert all(rows[name, ours]["peak_rate"] < 2.5 for name in names)
    assert rows[names[1], "pseudo-inverse"]["peak_rate"] > 100.0
    assert rows[names[1], "damped 0.02"]["behind"] > 15.0
    assert not rows[names[3], ours]["arrived"] and rows[names[3], "rate-limited QP"]["arrived"]
    assert all(rows[name, "rate-limited QP"]["peak_rate"] <= 3.0 + 1e-6 for name in names)


def test_peers_agree_far_from_every_singularity():
    rng = make_rng(21)
    for _ in range(50):
        q = np.array([0.3, 1.2, -0.4, 1.1, 0.5, 0.9, 0.1]) + 0.1 * rng.normal(size=7)
        twist = 0.1 * rng.normal(size=6)
        least = ARM.joint_velocity(q, twist).qdot
        np.testing.assert_allclose(peers.pseudo_inverse(ARM, q, twist), least, atol=1e-9)
        np.testing.assert_allclose(peers.adaptive_least_squares(ARM, q, twist), least, atol=1e-9)
        np.testing.assert_allclose(peers.damped_least_squares(ARM, q, twist, 1e-5), least, atol=1e-6)
        np.testing.assert_allclose(peers.rate_limited_program(ARM, q, twist, 9.0, 1e-5), least, atol=1e-4)
        np.testing.assert_allclose(peers.pink_program(ARM, q, twist, 9.0, 1e-5), least, atol=2e-2)


def test_programs_keep_the_rate_limit_and_the_damped_stay_finite():
    q = start(ARM, radial(ARM))
    q[3] = 1e-6
    twist = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0])
    assert np.abs(peers.rate_limited_program(ARM, q, twist, 2.0)).max() <= 2.0 + 1e-9
    assert np.abs(peers.pink_program(ARM, q, twist, 2.0)).max() <= 2.0 + 1e-6
    assert np.abs(peers.damped_least_squares(ARM, q, twist)).max() < 10.0
    assert np.abs(peers.adaptive_least_squares(ARM, q, twist)).max() < 10.0
    assert np.abs(peers.pseudo_inverse(ARM, q, twist)).max() > 1e4


@pytest.mark.parametrize(("call", "says"), [
    (lambda: arc(ARM, radius=0.8), "radius = 0.8"), (lambda: radial(ARM, run_up=0.0), "run_up = 0.0"),
    (lambda: radial(ARM, -0.01), "beyond = -0.01"), (lambda: run(radial(ARM), dt=0.0), "dt = 0.0"),
    (lambda: run(radial(ARM), feedback="c"), "feedback = 'c'"), (lambda: run(radial(ARM), 0), "n = 0"),
    (lambda: start(ARM, arc(ARM, -0.2)), "within reach"), (lambda: start(ARM, radial(ARM), 2), "a branch of 1 or -1"),
    (lambda: run(radial(ARM), q0=np.full(7, 4.0)), "q1 = 4.0"), (lambda: eigenvalue(ARM, -1.0), "radius = -1.0"),
])  # fmt: skip
def test_bad_input_is_named(call, says):
    with pytest.raises(InvalidValue) as raised:
        call()
    assert says in str(raised.value)


STRAIGHT = {"name": "x", "kind": "line", "start": (0.5, 0.0), "heading": (1.0, 0.0), "length": 0.1}
BAD_PATHS = [
    (radial, "beyond", ("2", -1.0, math.nan)), (radial, "run_up", (None, 0.0, math.inf)), (radial, "arm", (None,)),
    (release, "beyond", (-1, "1", math.nan, 1e300)), (release, "slant", (2.0, math.nan, "steep")),
    (release, "run_up", (-0.1, 0.0, 1.0, math.nan, None)), (release, "arm", ("left",)),
    (arc, "run_up", (-0.25, 0.0, 9.0, math.nan, "x")), (arc, "margin", (math.nan, None, 1e300)), (arc, "arm", (3,)),
]  # fmt: skip
BAD_PARTS = {
    "start": ((math.nan, 0.0), (1.0,), "here"), "heading": ((math.nan, 0.0), (1.0, 1.0), None), "name": (3,),
    "radius": (math.nan, -1.0, "x"), "length": (math.nan, 0.0), "returns": (1,), "kind": ("spiral",),
}  # fmt: skip


def refused(argument):
    return pytest.raises(TutorialbotError, match=f"^{argument} = ")


@pytest.mark.parametrize(("make", "argument", "values"), BAD_PATHS)
def test_what_makes_no_path_is_named(make, argument, values):
    for value in values:
        with refused(argument):
            make(**{"arm": ARM, argument: value})


@pytest.mark.parametrize("argument", BAD_PARTS)
def test_parts_that_make_no_path_are_named(argument):
    for value in BAD_PARTS[argument]:
        with refused(argument):
            StretchPath(**STRAIGHT | {argument: value})
    with refused("radius"):
        StretchPath(**STRAIGHT | {"kind": "arc"})


PLANE = {
    "speed": (-1.0, 0.0, 1e-300, 1e300, math.nan, None), "q4_range": (0.0, 3.2, math.nan, "x"), "n": (0, 1.5),
    "s_range": (-0.1, 0.0, 2.0, math.nan, "x"), "points": (0, 1, 2.5, 10**9), "arm": (None,),
}  # fmt: skip


@pytest.mark.parametrize("argument", PLANE)
def test_what_makes_no_plane_is_named(argument):
    for value in PLANE[argument]:
        for make in (portrait, line_portrait):
            with refused(argument):
                make(**{"arm": ARM, "points": 5, argument: value})
    for margins in (None, ("a",), (math.nan,)):
        with refused("margins"):
            portrait(ARM, margins=margins)


STEPS = {
    "speed": (-1.0, 1e-300, 1e300, math.nan, "x"), "dt": (0.0, 1e-300, 1e300, math.nan, "x"),
    "patience": (0.0, -1.0, 1e300, math.nan, None), "path": (None,), "arm": (None,),
}  # fmt: skip


@pytest.mark.parametrize("argument", STEPS)
def test_steps_without_end_and_none_are_named(argument):
    good = {"arm": ARM, "path": radial(ARM)}
    for value in STEPS[argument]:
        with refused(argument):
            trace(**good | {argument: value})
        with refused(argument):
            follow(**good | {"solver": singularity_consistent(2), argument: value})


def test_more_that_is_no_line_is_named():
    with refused("zero"):
        trace(ARM, radial(ARM), zero="x")
    with refused("path"):
        trace(ARM, arc(ARM, -0.2))
    with refused("solver"):
        follow(ARM, radial(ARM), None)
    with refused("gain"):
        run(radial(ARM), gain=math.nan)
    with refused("tolerance"):
        classify(ARM, radial(ARM), math.nan)


def test_a_joint_limit_ends_a_path_with_its_name():
    narrow = SphericalArm(limits=(2.9, 2.1, 2.9, 2.6, 0.7, 2.1, 2.9))
    found = follow(narrow, arc(narrow, 0.001), singularity_consistent(2))
    assert found.outcome == "joint limit" and not found.arrived


def test_any_function_of_arm_q_and_twist_can_be_followed():
    still = follow(ARM, radial(ARM), in_time(lambda arm, q, twist: np.zeros(7)), dt=0.05)
    assert still.peak_rate == 0.0 and still.behind.max() == pytest.approx(0.15, abs=1e-3)
