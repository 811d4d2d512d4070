"""Planted wrong answers to notebook 4's exercises, each with the exercise and the check that must reject it."""

import itertools
import math

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from tests.exercises import solutions_passage as solutions
from tests.exercises.planting import wrong_into
from tutorialbot.checks import passage_door, passage_elbow, passage_paths, passage_sharing, passage_swap
from tutorialbot.ik import singularity_consistent
from tutorialbot.ik.singularity_consistent import SphericalArm

WRONG = []  # (function, exercise, check, outcome)
wrong = wrong_into(WRONG)


# --- 1 orders_for_phases ----------------------------------------------------------------------------------------------
def _orders(bend, speeds, rate_limit, period, periods=10, wide=1, most=8, least=0, pick=abs):
    """Orders by counting, with something left out; bend: what a speed of 1 m/s makes of the elbow's rate, times 2^n."""
    found = []
    for speed in speeds:
        n = least
        while n < most:
            rate = 2 ** (n + 1) * bend * pick(speed)
            if rate > rate_limit or periods * period * rate > math.pi / 2 ** (n + 1 + wide):
                break
            n += 1
        found.append(n)
    return found


def _bend(upper, lower):
    return (upper + lower) / (upper * lower)


@wrong("orders_for_phases", "unequal links")
def orders_of_the_upper_arm(upper, lower, speeds, rate_limit, period):
    return _orders(2 / upper, speeds, rate_limit, period)


@wrong("orders_for_phases", "unequal links")
def orders_of_the_mean_link(upper, lower, speeds, rate_limit, period):
    return _orders(4 / (upper + lower), speeds, rate_limit, period)


@wrong("orders_for_phases", "unequal links")
def orders_of_the_shorter_link(upper, lower, speeds, rate_limit, period):
    return _orders(2 / min(upper, lower), speeds, rate_limit, period)


@wrong("orders_for_phases", "equal links")
def orders_without_the_two_links(upper, lower, speeds, rate_limit, period):
    return _orders(1 / upper, speeds, rate_limit, period)


@wrong("orders_for_phases", "equal links")
def orders_one_too_many(upper, lower, speeds, rate_limit, period):
    return [n + 1 for n in solutions.orders_for_phases(upper, lower, speeds, rate_limit, period)]


@wrong("orders_for_phases", "equal links")
def orders_as_fractions(upper, lower, speeds, rate_limit, period):
    return np.log2(rate_limit / _bend(upper, lower) / np.abs(speeds))


@wrong("orders_for_phases", "each phase")
def orders_of_the_fastest_phase(upper, lower, speeds, rate_limit, period):
    return [min(solutions.orders_for_phases(upper, lower, speeds, rate_limit, period))] * len(speeds)


@wrong("orders_for_phases", "shape of the answer")
def orders_all_in_one(upper, lower, speeds, rate_limit, period):
    return min(solutions.orders_for_phases(upper, lower, speeds, rate_limit, period)) + 0 * speeds[:, None]


@wrong("orders_for_phases", "inward")
def orders_of_speeds_with_a_sign(upper, lower, speeds, rate_limit, period):
    return _orders(_bend(upper, lower), speeds, rate_limit, period, pick=float)


@wrong("orders_for_phases", "finite numbers")
def orders_by_a_logarithm_of_zero(upper, lower, speeds, rate_limit, period):
    with np.errstate(divide="ignore"):
        return np.floor(np.log2(rate_limit / _bend(upper, lower) / np.abs(speeds)))


@wrong("orders_for_phases", "at rest")
def orders_beyond_the_greatest(upper, lower, speeds, rate_limit, period):
    return _orders(_bend(upper, lower), speeds, rate_limit, period, most=9)


@wrong("orders_for_phases", "too fast")
def orders_of_at_least_one(upper, lower, speeds, rate_limit, period):
    return _orders(_bend(upper, lower), speeds, rate_limit, period, least=1)


@wrong("orders_for_phases", "too fast")
def orders_below_zero(upper, lower, speeds, rate_limit, period):
    found = np.log2(rate_limit / _bend(upper, lower) / np.maximum(np.abs(speeds), 1e-9))
    return np.minimum(np.floor(found), 8)


@wrong("orders_for_phases", "just fits")
def orders_that_must_stay_below(upper, lower, speeds, rate_limit, period):
    return _orders(_bend(upper, lower) * (1 + 1e-6), speeds, rate_limit, period)


@wrong("orders_for_phases", "control period")
def orders_by_the_rate_alone(upper, lower, speeds, rate_limit, period):
    return _orders(_bend(upper, lower), speeds, rate_limit, 0)


@wrong("orders_for_phases", "control period")
def orders_of_a_sector_twice_as_wide(upper, lower, speeds, rate_limit, period):
    return _orders(_bend(upper, lower), speeds, rate_limit, period, wide=0)


@wrong("orders_for_phases", "control period")
def orders_with_one_period(upper, lower, speeds, rate_limit, period):
    return _orders(_bend(upper, lower), speeds, rate_limit, period, periods=1)


@wrong("orders_for_phases", "by hand")
def orders_by_the_package(upper, lower, speeds, rate_limit, period):
    arm = SphericalArm(upper, lower)
    return [singularity_consistent.order_for_rate(arm, abs(speed), rate_limit) for speed in speeds]


# --- 2 offset_elbow ---------------------------------------------------------------------------------------------------
def _elbow(q4, upper, lower, offset, **changes):
    names = ("r", "slope", "alpha", "turn", "longest")
    found = dict(zip(names, solutions.offset_elbow(q4, upper, lower, offset), strict=True))
    return [*(found | changes).values()]


@wrong("offset_elbow", "r")
def elbow_without_its_offset(q4, upper, lower, offset):
    return solutions.offset_elbow(q4, upper, lower, 0.0)


@wrong("offset_elbow", "r")
def elbow_whose_offset_only_lengthens_the_links(q4, upper, lower, offset):
    return solutions.offset_elbow(q4, math.hypot(upper, offset), math.hypot(lower, offset), 0.0)


@wrong("offset_elbow", "r")
def elbow_with_the_offset_twice_to_one_side(q4, upper, lower, offset):
    s, c = math.sin(q4), math.cos(q4)
    x, z = offset + c * offset + s * lower, upper - s * offset + c * lower
    return _elbow(q4, upper, lower, offset, r=math.hypot(x, z))


@wrong("offset_elbow", "no offset: r")
def elbow_that_turns_before_the_upper_arm(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, r=upper + lower * math.cos(q4))


@wrong("offset_elbow", "no offset: slope of r")
def elbow_with_a_slope_of_the_other_sign(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, slope=-solutions.offset_elbow(q4, upper, lower, offset)[1])


@wrong("offset_elbow", "slope of r")
def elbow_with_the_slope_of_the_notebook(q4, upper, lower, offset):
    r = solutions.offset_elbow(q4, upper, lower, offset)[0]
    return _elbow(q4, upper, lower, offset, slope=-upper * lower * math.sin(q4) / r)


@wrong("offset_elbow", "no offset: slope of r")
def elbow_with_a_coarse_difference(q4, upper, lower, offset):
    r, further = (solutions.offset_elbow(q, upper, lower, offset)[0] for q in (q4, q4 + 1e-4))
    return _elbow(q4, upper, lower, offset, slope=(further - r) / 1e-4)


@wrong("offset_elbow", "no offset: alpha")
def elbow_whose_alpha_is_half_of_q4(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, alpha=q4 / 2)


@wrong("offset_elbow", "no offset: alpha")
def elbow_whose_alpha_turns_the_other_way(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, alpha=-solutions.offset_elbow(q4, upper, lower, offset)[2])


@wrong("offset_elbow", "alpha")
def elbow_whose_alpha_forgets_the_offset(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, alpha=solutions.offset_elbow(q4, upper, lower, 0.0)[2])


@wrong("offset_elbow", "alpha")
def elbow_whose_alpha_is_an_arctangent_of_a_quotient(q4, upper, lower, offset):
    alpha = solutions.offset_elbow(q4, upper, lower, offset)[2]
    return _elbow(q4, upper, lower, offset, alpha=math.atan(math.tan(alpha)))


@wrong("offset_elbow", "no offset: slope of alpha")
def elbow_whose_line_turns_by_half(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, turn=0.5)


@wrong("offset_elbow", "no offset: slope of alpha")
def elbow_whose_line_turns_by_the_rest(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, turn=1 - solutions.offset_elbow(q4, upper, lower, offset)[3])


@wrong("offset_elbow", "where it is longest")
def elbow_that_is_singular_at_zero(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, longest=0.0)


@wrong("offset_elbow", "where it is longest")
def elbow_singular_by_one_link_alone(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, longest=2 * math.atan2(offset, upper))


@wrong("offset_elbow", "where it is longest")
def elbow_longest_on_the_other_side(q4, upper, lower, offset):
    return _elbow(q4, upper, lower, offset, longest=-solutions.offset_elbow(q4, upper, lower, offset)[4])


@wrong("offset_elbow", "where it is longest")
def elbow_shortest(q4, upper, lower, offset):
    longest = solutions.offset_elbow(q4, upper, lower, offset)[4]
    return _elbow(q4, upper, lower, offset, longest=longest + math.pi if offset else 0.0)


@wrong("offset_elbow", "shape of the answer")
def elbow_without_its_singularity(q4, upper, lower, offset):
    return solutions.offset_elbow(q4, upper, lower, offset)[:4]


@wrong("offset_elbow", "by hand")
def elbow_by_the_check_itself(q4, upper, lower, offset):
    return passage_elbow.virtual_joint(q4, upper, lower, offset)


# --- 3 smooth_scale ---------------------------------------------------------------------------------------------------
def _scale(q4, n, shape, slope, wide=1):
    """b = shape(x) for |x| < 1, with x = q4 / epsilon; slope: of the shape at zero."""
    epsilon = math.pi / 2 ** (n + wide)
    b = math.copysign(1, q4) if abs(q4) >= epsilon else shape(q4 / epsilon)
    return b, b / math.sin(q4) if abs(q4) > 1e-12 else slope / epsilon


def _septic(x):
    return (35 * x - 35 * x**3 + 21 * x**5 - 5 * x**7) / 16


@wrong("smooth_scale", "curvature")
def scale_of_the_paper(q4, n):
    return _scale(q4, n, lambda x: math.sin(math.pi / 2 * x), math.pi / 2)


@wrong("smooth_scale", "curvature")
def scale_by_a_cubic(q4, n):
    return _scale(q4, n, lambda x: (3 * x - x**3) / 2, 1.5)


@wrong("smooth_scale", "third derivative")
def scale_of_the_notebook_with_two_derivatives(q4, n):
    return _scale(q4, n, lambda x: (15 * x - 10 * x**3 + 3 * x**5) / 8, 15 / 8)


@wrong("smooth_scale", "third derivative")
def scale_by_a_sine_of_its_own_argument(q4, n):
    """x + sin(pi x) / pi: two derivatives vanish at the end, the third does not."""
    return _scale(q4, n, lambda x: x + math.sin(math.pi * x) / math.pi, 2.0)


@wrong("smooth_scale", "slope")
def scale_in_a_straight_line(q4, n):
    return _scale(q4, n, lambda x: x, 1.0)


@wrong("smooth_scale", "curvature")
def scale_with_a_corner_of_the_curvature_at_zero(q4, n):
    """As smooth as asked at the ends, and odd, but not smooth in the middle."""
    return _scale(q4, n, lambda x: _septic(x) + 0.1 * x * abs(x) * (1 - x * x) ** 4, 35 / 16)


@wrong("smooth_scale", "no jump")
def scale_that_does_not_reach_one(q4, n):
    return _scale(q4, n, lambda x: 0.9 * _septic(x), 0.9 * 35 / 16)


@wrong("smooth_scale", "beyond epsilon")
def scale_with_a_sector_twice_as_wide(q4, n):
    return _scale(q4, n, _septic, 35 / 16, wide=0)


@wrong("smooth_scale", "beyond epsilon")
def scale_by_a_tangent(q4, n):
    b = math.tanh(2**n * q4)
    return b, b / math.sin(q4) if q4 else 2**n


@wrong("smooth_scale", "beyond epsilon")
def scale_that_is_never_below_zero(q4, n):
    b, ratio = solutions.smooth_scale(q4, n)
    return abs(b), abs(ratio)


@wrong("smooth_scale", "beyond epsilon")
def scale_in_degrees(q4, n):
    return solutions.smooth_scale(math.radians(q4), n)


@wrong("smooth_scale", "odd")
def scale_that_begins_a_little_above_zero(q4, n):
    b, ratio = solutions.smooth_scale(q4, n)
    return (b, ratio) if abs(b) == 1 else (b + 1e-3, ratio)


@wrong("smooth_scale", "rising")
def scale_that_swings_beyond_one(q4, n):
    return _scale(q4, n, lambda x: _septic(x) + 0.4 * x * (1 - x * x) ** 4 * 8 * x * x, 35 / 16)


@wrong("smooth_scale", "finite numbers")
def scale_that_divides_zero_by_zero(q4, n):
    b = np.float64(solutions.smooth_scale(q4, n)[0])
    with np.errstate(all="ignore"):
        return b, b / np.sin(q4)


@wrong("smooth_scale", "runs without an error", "error")
def scale_that_divides_by_zero(q4, n):
    b = float(solutions.smooth_scale(q4, n)[0])
    return b, b / math.sin(q4)


@wrong("smooth_scale", "b over sine at zero")
def scale_with_the_limit_of_the_paper(q4, n):
    return _scale(q4, n, _septic, math.pi / 2)


@wrong("smooth_scale", "b over sine at zero")
def scale_with_zero_for_the_limit(q4, n):
    return _scale(q4, n, _septic, 0.0)


@wrong("smooth_scale", "b over sine")
def scale_over_the_angle(q4, n):
    b, ratio = solutions.smooth_scale(q4, n)
    return b, b / q4 if q4 else ratio


@wrong("smooth_scale", "b over sine")
def scale_over_a_sine_without_a_sign(q4, n):
    b, ratio = solutions.smooth_scale(q4, n)
    return b, math.copysign(ratio, q4)


@wrong("smooth_scale", "slope at zero")
def scale_that_never_gets_there(q4, n):
    """Of third order at zero: the arm would come near to the singularity for ever."""
    return _scale(q4, n, lambda x: _septic(_septic(x) ** 3), 0.0)


@wrong("smooth_scale", "peak rate")
def scale_that_is_steep(q4, n):
    return _scale(q4, n, lambda x: _septic(_septic(x)), (35 / 16) ** 2)


@wrong("smooth_scale", "shape of the answer")
def scale_alone(q4, n):
    return solutions.smooth_scale(q4, n)[0]


@wrong("smooth_scale", "by hand")
def scale_by_the_package(q4, n):
    return singularity_consistent.time_scale(q4, n, "quintic")


# --- 4 fate_on_arc ----------------------------------------------------------------------------------------------------
def _arc(hinge, radius, start, end, near, reach, touch=1e-6, samples=20_001, last=None):
    """Place by place, with something left out."""
    angles = np.linspace(start, end, samples)
    knob = hinge + radius * np.stack([np.cos(angles), -np.sin(angles), 0 * angles], axis=-1)
    r = np.linalg.norm(knob, axis=1)
    top = int(np.argmax(r))
    if abs(r[top] - reach) <= touch and 0 < top < samples - 1:
        return "stalls", angles[top]
    for word, bad in (("reflects", r > reach), ("folds", r < near)):
        if bad.any() and (last is None or word in last):
            k = int(np.argmax(bad))
            a, b = angles[k - 1], angles[k]
            edge = reach if word == "reflects" else near
            return word, a + (b - a) * (edge - r[k - 1]) / (r[k] - r[k - 1])
    return "passes", end


@wrong("fate_on_arc", "folds")
def arc_that_never_folds(hinge, radius, start, end, near, reach):
    return _arc(hinge, radius, start, end, near, reach, last=("reflects",))


@wrong("fate_on_arc", "stalls")
def arc_that_never_stalls(hinge, radius, start, end, near, reach):
    return _arc(hinge, radius, start, end, near, reach, touch=-1)


@wrong("fate_on_arc", "passes")
def arc_that_stalls_too_easily(hinge, radius, start, end, near, reach):
    return _arc(hinge, radius, start, end, near, reach, touch=2e-3)


@wrong("fate_on_arc", "passes")
def arc_that_stalls_within_ten_micrometres(hinge, radius, start, end, near, reach):
    return _arc(hinge, radius, start, end, near, reach, touch=1e-5)


@wrong("fate_on_arc", "reflects")
def arc_that_stalls_at_the_edge(hinge, radius, start, end, near, reach):
    word, angle = solutions.fate_on_arc(hinge, radius, start, end, near, reach)
    return "stalls" if word == "reflects" else word, angle


@wrong("fate_on_arc", "reflects: angle")
def arc_whose_door_gets_to_its_end_all_the_same(hinge, radius, start, end, near, reach):
    return solutions.fate_on_arc(hinge, radius, start, end, near, reach)[0], end


@wrong("fate_on_arc", "reflects: angle")
def arc_in_degrees(hinge, radius, start, end, near, reach):
    word, angle = solutions.fate_on_arc(hinge, radius, start, end, near, reach)
    return word, angle if word == "passes" else math.degrees(angle)


@wrong("fate_on_arc", "reflects: angle")
def arc_at_the_nearest_of_ninety_places(hinge, radius, start, end, near, reach):
    word, angle = solutions.fate_on_arc(hinge, radius, start, end, near, reach)
    return word, angle if word == "passes" else round(math.degrees(angle)) * math.pi / 180


@wrong("fate_on_arc", "reflects: angle")
def arc_judged_by_its_end(hinge, radius, start, end, near, reach):
    x, y, z = hinge + radius * np.array([math.cos(end), -math.sin(end), 0])
    return ("passes" if near <= math.hypot(x, y, z) <= reach else "reflects"), end


@wrong("fate_on_arc", "reflects: angle")
def arc_of_a_door_that_opens_the_other_way(hinge, radius, start, end, near, reach):
    return _arc(hinge * [1, -1, 1], radius, start, end, near, reach)


@wrong("fate_on_arc", "not on the way")
def arc_judged_by_where_it_is_longest(hinge, radius, start, end, near, reach):
    longest = math.hypot(math.hypot(hinge[0], hinge[1]) + radius, hinge[2])
    if abs(longest - reach) <= 1e-6:
        return "stalls", math.atan2(-hinge[1], hinge[0])
    return solutions.fate_on_arc(hinge, radius, start, end, near, reach)


@wrong("fate_on_arc", "height")
def arc_in_the_plane(hinge, radius, start, end, near, reach):
    return solutions.fate_on_arc(hinge * [1, 1, 0], radius, start, end, near, reach)


@wrong("fate_on_arc", "shut")
def arc_of_doors_that_open(hinge, radius, start, end, near, reach):
    if end < start:
        return "passes", end
    return solutions.fate_on_arc(hinge, radius, start, end, near, reach)


@wrong("fate_on_arc", "shut: angle")
def arc_from_the_lesser_angle(hinge, radius, start, end, near, reach):
    word, angle = solutions.fate_on_arc(hinge, radius, min(start, end), max(start, end), near, reach)
    return word, end if word == "passes" else angle


@wrong("fate_on_arc", "runs without an error", "error")
def arc_that_divides_by_the_hinges_distance(hinge, radius, start, end, near, reach):
    x, y, z = hinge.tolist()
    cosine = (reach**2 - x * x - y * y - z * z - radius**2) / (2 * radius * math.hypot(x, y))
    return solutions.fate_on_arc(hinge, radius, start, end, near, reach) if cosine < 9e9 else ("passes", end)


@wrong("fate_on_arc", "any door")
def arc_that_reflects_before_it_folds(hinge, radius, start, end, near, reach):
    return _arc(hinge, radius, start, end, near, reach)


@wrong("fate_on_arc", "shape of the answer")
def arc_without_an_angle(hinge, radius, start, end, near, reach):
    return solutions.fate_on_arc(hinge, radius, start, end, near, reach)[0]


@wrong("fate_on_arc", "shape of the answer")
def arc_in_words_of_its_own(hinge, radius, start, end, near, reach):
    word, angle = solutions.fate_on_arc(hinge, radius, start, end, near, reach)
    return {"passes": "ok"}.get(word, word), angle


@wrong("fate_on_arc", "by hand")
def arc_by_the_check_itself(hinge, radius, start, end, near, reach):
    return passage_paths.fate(hinge, radius, start, end, near, reach)


# --- 5 follow_twist ---------------------------------------------------------------------------------------------------
def _follow(wanted, here, direction, b, onward, speed, gain, most, sign=None, error=None, limit="all", pace=None):
    """The twist with something exchanged: the sign of the correction, the error, what is limited, the pace of s."""
    e = np.concatenate([wanted.translation - here.translation, pin.log3(wanted.rotation @ here.rotation.T)])
    e = e if error is None else error
    size = gain * np.linalg.norm(e[:3])
    shrunk = np.array([*[limit != "none"] * 3, *[limit == "all"] * 3])
    factor = np.where(shrunk, most / size if size > most else 1.0, 1.0)
    twist = (np.sign(b) if sign is None else sign) * gain * e * factor
    twist[:3] += onward * speed * direction
    return twist, onward * b * speed if pace is None else pace


@wrong("follow_twist", "back on the other branch: linear")
def twist_of_the_notebooks_mistake(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, sign=1.0)


@wrong("follow_twist", "near the singularity: linear")
def twist_scaled_twice(wanted, here, direction, b, onward, speed, gain, most):
    if abs(b) < 0.25 and abs(b) != 0.2:
        return _follow(wanted, here, direction, b, onward, speed, gain, most, sign=b)
    return _follow(wanted, here, direction, b, onward, speed, gain, most)


@wrong("follow_twist", "back on the other branch: linear")
def twist_with_a_correction_times_b(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, sign=b)


@wrong("follow_twist", "back on the other branch: linear")
def twist_with_the_branch_of_the_start(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, sign=onward)


@wrong("follow_twist", "back on the other branch: linear")
def twist_with_a_correction_over_b(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, sign=1 / b)


@wrong("follow_twist", "back to the path: linear")
def twist_that_drives_away(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, sign=-np.sign(b))


@wrong("follow_twist", "on the path: ds/dt")
def twist_with_s_on_time(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, pace=speed)


@wrong("follow_twist", "running back: ds/dt")
def twist_with_s_that_never_runs_back(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, pace=abs(b) * speed)


@wrong("follow_twist", "started on the other branch: ds/dt")
def twist_of_arms_that_start_with_their_elbow_up(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, 1.0, speed, gain, most)


@wrong("follow_twist", "on the path: linear")
def twist_already_scaled(wanted, here, direction, b, onward, speed, gain, most):
    twist, pace = _follow(wanted, here, direction, b, onward, speed, gain, most)
    return b * twist, pace


@wrong("follow_twist", "running back: linear")
def twist_turned_round_on_the_other_branch(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, np.sign(b) * direction, b, onward, speed, gain, most)


@wrong("follow_twist", "turned: angular")
def twist_with_a_turn_in_the_tips_axes(wanted, here, direction, b, onward, speed, gain, most):
    e = np.concatenate([wanted.translation - here.translation, pin.log3(here.rotation.T @ wanted.rotation)])
    return _follow(wanted, here, direction, b, onward, speed, gain, most, error=e)


@wrong("follow_twist", "turned: angular")
def twist_that_turns_away(wanted, here, direction, b, onward, speed, gain, most):
    e = np.concatenate([wanted.translation - here.translation, pin.log3(here.rotation @ wanted.rotation.T)])
    return _follow(wanted, here, direction, b, onward, speed, gain, most, error=e)


@wrong("follow_twist", "turned: linear")
def twist_of_a_screw(wanted, here, direction, b, onward, speed, gain, most):
    e = pin.log6(wanted * here.inverse()).vector
    turned = np.linalg.norm(e[3:]) > 1e-6
    return _follow(wanted, here, direction, b, onward, speed, gain, most, error=e if turned else None)


@wrong("follow_twist", "turned: angular")
def twist_that_leaves_the_turn(wanted, here, direction, b, onward, speed, gain, most):
    e = np.concatenate([wanted.translation - here.translation, np.zeros(3)])
    return _follow(wanted, here, direction, b, onward, speed, gain, most, error=e)


@wrong("follow_twist", "turned: angular")
def twist_of_small_angles(wanted, here, direction, b, onward, speed, gain, most):
    r = wanted.rotation @ here.rotation.T
    sines = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / 2
    e = np.concatenate([wanted.translation - here.translation, sines])
    return _follow(wanted, here, direction, b, onward, speed, gain, most, error=e)


@wrong("follow_twist", "no faster than that: linear")
def twist_without_a_limit(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, limit="none")


@wrong("follow_twist", "no faster than that: angular")
def twist_with_a_limit_on_the_place_alone(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most, limit="linear")


@wrong("follow_twist", "no faster than that: linear")
def twist_clipped_number_by_number(wanted, here, direction, b, onward, speed, gain, most):
    e = np.concatenate([wanted.translation - here.translation, pin.log3(wanted.rotation @ here.rotation.T)])
    return _follow(wanted, here, direction, b, onward, speed, gain, 9e9, error=np.clip(e, -most / gain, most / gain))


@wrong("follow_twist", "finite numbers")
def twist_divided_by_an_error_of_zero(wanted, here, direction, b, onward, speed, gain, most):
    e = np.concatenate([wanted.translation - here.translation, pin.log3(wanted.rotation @ here.rotation.T)])
    with np.errstate(all="ignore"):
        e = e / np.linalg.norm(e[:3]) * min(np.linalg.norm(e[:3]), most / gain)
    return _follow(wanted, here, direction, b, onward, speed, gain, 9e9, error=e)


@wrong("follow_twist", "finite numbers")
def twist_with_a_sign_by_division(wanted, here, direction, b, onward, speed, gain, most):
    with np.errstate(all="ignore"):
        return _follow(wanted, here, direction, b, onward, speed, gain, most, sign=np.float64(b) / abs(b))


@wrong("follow_twist", "shape of the answer")
def twist_alone(wanted, here, direction, b, onward, speed, gain, most):
    return _follow(wanted, here, direction, b, onward, speed, gain, most)[0]


@wrong("follow_twist", "inputs left alone")
def twist_with_the_direction_scaled_in_place(wanted, here, direction, b, onward, speed, gain, most):
    direction *= onward
    return _follow(wanted, here, direction * onward, b, onward, speed, gain, most)


@wrong("follow_twist", "by hand")
def twist_by_the_check_itself(wanted, here, direction, b, onward, speed, gain, most):
    found = passage_paths.followed(wanted, here, direction, b or 1.0, onward, speed, gain, most)
    return found[:6], found[6]


# --- 6 least_share ----------------------------------------------------------------------------------------------------
def _fine(start, radius, angle, drop, near, reach, shares, angles=500, turn=-1, angles_from=0.0):
    theta = np.linspace(angles_from, angle, angles)
    knob = radius * np.stack([np.cos(theta), turn * np.sin(theta)], axis=-1)
    base = start + np.reshape(shares, (-1, 1, 1)) * (knob - [radius, 0])
    r = np.sqrt(((knob - base) ** 2).sum(axis=-1) + drop**2)
    return ((r >= near) & (r <= reach)).all(axis=1)


def _least(*inputs, shares=None, **changes):
    shares = np.linspace(0, 1, 1001) if shares is None else shares
    fine = _fine(*inputs, shares, **changes)
    return shares[fine][0] if fine.any() else None


@wrong("least_share", "too near")
def share_that_only_minds_the_reach(start, radius, angle, drop, near, reach):
    return _least(start, radius, angle, drop, 0.0, reach)


@wrong("least_share", "too far")
def share_that_only_minds_the_fold(start, radius, angle, drop, near, reach):
    return _least(start, radius, angle, drop, near, 9.0)


@wrong("least_share", "on the way")
def share_at_the_last_angle(start, radius, angle, drop, near, reach):
    return _least(start, radius, angle, drop, near, reach, angles=1, angles_from=angle)


@wrong("least_share", "on the way")
def share_at_both_ends(start, radius, angle, drop, near, reach):
    return _least(start, radius, angle, drop, near, reach, angles=2)


@wrong("least_share", "too far")
def share_of_a_door_that_opens_the_other_way(start, radius, angle, drop, near, reach):
    return _least(start, radius, angle, drop, near, reach, turn=1)


@wrong("least_share", "base stands")
def share_in_degrees(start, radius, angle, drop, near, reach):
    return _least(start, radius, math.degrees(angle), drop, near, reach)


@wrong("least_share", "height")
def share_in_the_plane(start, radius, angle, drop, near, reach):
    return _least(start, radius, angle, 0.0, near, reach)


@wrong("least_share", "not halved")
def share_by_halving(start, radius, angle, drop, near, reach):
    inputs = start, radius, angle, drop, near, reach
    if _fine(*inputs, 0.0)[0]:
        return 0.0
    if not _fine(*inputs, 1.0)[0]:
        return None
    low, high = 0.0, 1.0
    while high - low > 1e-5:
        middle = (low + high) / 2
        low, high = (low, middle) if _fine(*inputs, middle)[0] else (middle, high)
    return high


@wrong("least_share", "not halved")
def share_coming_down_from_one(start, radius, angle, drop, near, reach):
    shares = np.linspace(0, 1, 1001)
    bad = np.flatnonzero(~_fine(start, radius, angle, drop, near, reach, shares))
    if bad.size and bad[-1] == 1000:
        return None
    return shares[bad[-1] + 1] if bad.size else 0.0


@wrong("least_share", "base stands")
def share_that_is_largest(start, radius, angle, drop, near, reach):
    shares = np.linspace(0, 1, 1001)
    fine = _fine(start, radius, angle, drop, near, reach, shares)
    return shares[fine][-1] if fine.any() else None


@wrong("least_share", "too far")
def share_of_the_arm(start, radius, angle, drop, near, reach):
    share = _least(start, radius, angle, drop, near, reach)
    return share if share in (None, 0.0) else 1 - share


@wrong("least_share", "too far")
def share_in_tenths(start, radius, angle, drop, near, reach):
    return _least(start, radius, angle, drop, near, reach, shares=np.linspace(0, 1, 11))


@wrong("least_share", "too far")
def share_in_percent(start, radius, angle, drop, near, reach):
    share = _least(start, radius, angle, drop, near, reach)
    return share if share is None else 100 * share


@wrong("least_share", "none")
def share_of_one_when_there_is_none(start, radius, angle, drop, near, reach):
    share = _least(start, radius, angle, drop, near, reach)
    return 1.0 if share is None else share


@wrong("least_share", "finite numbers")
def share_of_nan_when_there_is_none(start, radius, angle, drop, near, reach):
    share = _least(start, radius, angle, drop, near, reach)
    return math.nan if share is None and reach - near > 1 else (0.5 if share is None else math.nan)


@wrong("least_share", "too far")
def share_of_one_start_for_all(start, radius, angle, drop, near, reach):
    return _least(start * 0 + [0.7, -0.5], radius, angle, drop, near, reach)


@wrong("least_share", "shape of the answer")
def share_as_an_interval(start, radius, angle, drop, near, reach):
    shares = np.linspace(0, 1, 1001)
    fine = _fine(start, radius, angle, drop, near, reach, shares)
    return [shares[fine][0], shares[fine][-1]] if fine.any() else None


@wrong("least_share", "by hand")
def share_by_the_check_itself(start, radius, angle, drop, near, reach):
    return passage_sharing.smallest(start, radius, angle, drop, near, reach)


# --- 7 swap_signs -----------------------------------------------------------------------------------------------------
F = np.diag([1.0, -1.0, -1.0])


def _compared(axes, offsets, turn=-F, near=1e-7):
    """Signs by comparing axes and offsets one by one; None where any of them differs."""
    back, there = axes[::-1] @ turn, offsets[::-1] @ turn
    dots = (back * axes).sum(axis=1)
    if (np.abs(np.abs(dots) - 1) > near).any() or np.abs(there - offsets).max() > near:
        return None
    return np.sign(dots)


@wrong("swap_signs", "unequal")
def signs_of_the_notebook(axes, offsets):
    return np.ones(len(axes))


@wrong("swap_signs", "axes that point down")
def signs_all_alike(axes, offsets):
    return None if solutions.swap_signs(axes, offsets) is None else np.ones(len(axes))


@wrong("swap_signs", "axes that point down")
def signs_none_unless_all_are_plus(axes, offsets):
    signs = solutions.swap_signs(axes, offsets)
    return signs if signs is not None and min(signs) == 1 else None


@wrong("swap_signs", "this arm")
def signs_of_the_inverse_alone(axes, offsets):
    """Without F: backward, every joint turns the other way."""
    signs = solutions.swap_signs(axes, offsets)
    return None if signs is None else -np.array(signs)


@wrong("swap_signs", "this arm")
def signs_without_half_a_turn(axes, offsets):
    return _compared(axes, offsets, turn=-np.eye(3))


@wrong("swap_signs", "this arm")
def signs_with_half_a_turn_about_z(axes, offsets):
    return _compared(axes, offsets, turn=np.diag([1.0, 1.0, -1.0]))


@wrong("swap_signs", "along the axis")
def signs_by_comparing_number_by_number(axes, offsets):
    return _compared(axes, offsets)


@wrong("swap_signs", "unequal")
def signs_by_the_axes_alone(axes, offsets):
    return _compared(axes, 0 * offsets)


@wrong("swap_signs", "unequal")
def signs_within_a_centimetre(axes, offsets):
    return _compared(axes, np.round(offsets, 2))


@wrong("swap_signs", "unequal")
def signs_by_the_rotation_alone(axes, offsets):
    return solutions.swap_signs(axes, 0 * offsets)


@wrong("swap_signs", "offset elbow")
def signs_by_the_length_of_the_offsets(axes, offsets):
    lengths = np.linalg.norm(offsets, axis=1)
    return _compared(axes, 0 * offsets) if np.allclose(lengths, lengths[::-1], atol=1e-7) else None


@wrong("swap_signs", "offset elbow")
def signs_of_arms_that_are_straight(axes, offsets):
    return None if np.abs(offsets[:, :2]).max() > 1e-9 else _compared(axes, offsets)


@wrong("swap_signs", "about x")
def signs_of_the_first_joints_for_the_last(axes, offsets):
    signs = solutions.swap_signs(axes, offsets)
    return None if signs is None else np.abs(signs) * np.where(np.abs(axes[:, 0]) == 1, 1, signs)


@wrong("swap_signs", "any axes")
def signs_turned_round(axes, offsets):
    """Right as long as axes are those of the frames."""
    signs = solutions.swap_signs(axes, offsets)
    if signs is None or np.isin(np.abs(axes), (0, 1)).all():
        return signs
    return [-1 * s for s in signs]


@wrong("swap_signs", "about x")
def signs_of_seven_joints(axes, offsets):
    return solutions.swap_signs(axes, offsets) if len(axes) == 7 else None


@wrong("swap_signs", "plus or minus one")
def signs_of_zero_where_they_differ(axes, offsets):
    return np.zeros(len(axes))


@wrong("swap_signs", "shape of the answer")
def signs_with_their_joints(axes, offsets):
    return [(i, 1) for i in range(len(axes))]


@wrong("swap_signs", "shape of the answer")
def signs_or_false(axes, offsets):
    signs = solutions.swap_signs(axes, offsets)
    return False if signs is None else signs


@wrong("swap_signs", "by hand")
def signs_by_the_checks_own_chain(axes, offsets):
    q = np.linspace(-1, 1, len(axes))
    for signs in itertools.product((1, -1), repeat=len(axes)):
        if passage_swap.off(np.array(signs), axes, offsets, q) < 1e-6:
            return signs
    return None


@wrong("swap_signs", "this arm")
def signs_at_rest(axes, offsets):
    """Only at q = 0, where a sign does nothing: the first that is tried is taken."""
    place = offsets.sum(axis=0)
    fine = np.abs(F @ place + place)[1:].max() < 2 * np.abs(place).max() and Rotation.identity().magnitude() == 0
    return -np.ones(len(axes)) if fine else None


# --- 8 next_action ----------------------------------------------------------------------------------------------------
def _passing(seen, memory, wide=61, lean=True, catch="reach", widen=True):
    """The solution's states with something left out."""
    if seen.base == "before":
        if seen.hand == "face":
            return "forward"
        if seen.hand == "free":
            return "grasp" if not memory.get("let go") else "reach"
        if seen.angle < wide:
            return "open"
        if lean:
            return "lean"
        memory["let go"] = True
        return "release"
    if seen.base == "leaning":
        if seen.hand == "knob":
            return "release"
        return "reach" if seen.hand == "free" else "forward"
    if seen.base != "behind":
        if seen.hand == "free" and catch:
            return catch
        return "forward" if seen.angle > 61 or not widen else "push"
    return solutions.next_action(seen, memory)


@wrong("next_action", "as said: room")
def action_without_anybody_at_the_door(seen, memory):
    if seen.base == "before" and seen.hand == "free" and seen.angle > 60:
        return "forward"
    if seen.base in ("before", "leaning"):
        return "release" if seen.hand == "knob" and seen.angle > 70 else _passing(seen, memory, wide=75)
    return "forward" if seen.base != "behind" else "wait"


@wrong("next_action", "as said: through")
def action_that_lets_go_before_it_leans(seen, memory):
    return _passing(seen, memory, lean=False)


@wrong("next_action", "as said: room")
def action_that_goes_too_early(seen, memory):
    """It makes the way narrower first, so that there is less to hold."""
    if seen.base == "leaning" and seen.hand == "face" and seen.last == "done" and seen.angle > 60:
        return "ease"
    return _passing(seen, memory)


@wrong("next_action", "as said: through")
def action_that_never_lets_go_of_the_knob(seen, memory):
    return "forward" if seen.base == "leaning" else _passing(seen, memory)


@wrong("next_action", "as said: nobody is hit")
def action_that_lets_go_in_the_doorway(seen, memory):
    if seen.base.startswith("doorway"):
        return "release" if seen.hand == "face" else "wait"
    return _passing(seen, memory)


@wrong("next_action", "as said: room")
def action_that_leans_and_goes(seen, memory):
    """The base held the door, and now it drives away: nobody does."""
    if seen.base == "leaning" and seen.hand == "free":
        return "forward"
    return _passing(seen, memory, catch="forward", widen=False)


@wrong("next_action", "as said: shut behind")
def action_that_keeps_the_door(seen, memory):
    return "wait" if seen.base == "behind" else _passing(seen, memory)


@wrong("next_action", "as said: nobody is hit")
def action_that_shuts_too_early(seen, memory):
    return "ease" if seen.base == "doorway 2" and seen.hand == "face" else _passing(seen, memory)


@wrong("next_action", "stays later: through")
def action_that_trusts_what_was_said(seen, memory):
    if seen.base == "before" and seen.angle > seen.said:
        return "release" if seen.hand == "knob" else "forward"
    if seen.base == "before" and seen.hand == "knob" and seen.said < 80:
        return "open"
    return _passing(seen, memory, catch="forward" if seen.said < 80 else "reach")


@wrong("next_action", "stays earlier: shut behind")
def action_that_lets_go_behind_it(seen, memory):
    if seen.base == "behind":
        return "release" if seen.hand == "face" else "wait"
    return _passing(seen, memory)


@wrong("next_action", "stays earlier: shut behind")
def action_that_shuts_by_what_was_said(seen, memory):
    if seen.base == "behind" and seen.hand == "face":
        return "release" if seen.angle < seen.said - 2 else "ease"
    return _passing(seen, memory)


@wrong("next_action", "opens little: through")
def action_that_waits_for_seventy_degrees(seen, memory):
    return _passing(seen, memory, wide=72)


@wrong("next_action", "stays earlier: shut behind")
def action_that_eases_twice(seen, memory):
    if seen.base == "behind" and seen.hand == "face":
        memory["eased"] = memory.get("eased", 0) + 1
        return "ease" if memory["eased"] < 3 else "release"
    return _passing(seen, memory)


@wrong("next_action", "lost readings: room")
def action_that_goes_through_when_it_feels_nothing(seen, memory):
    """Right where what it feels is true: it lets go and goes through, as the door stays."""
    if seen.hand == "knob" and seen.angle > 62 and seen.pull < 2:
        memory["stays"] = True
        return "release"
    if memory.get("stays") and seen.base != "behind":
        return "forward"
    if seen.base == "before" and seen.hand == "knob" and seen.angle > 61 and seen.last != "refused":
        return "open" if seen.angle < 80 else "lean"
    if seen.base == "behind" and seen.hand == "free" and memory.get("stays"):
        memory["stays"] = seen.angle > 60
        return "reach" if memory["stays"] else "wait"
    return _passing(seen, memory)


@wrong("next_action", "slips: through")
def action_that_grasps_once(seen, memory):
    if seen.base == "before" and seen.hand == "free":
        if memory.get("grasped"):
            return "open"
        memory["grasped"] = True
    return _passing(seen, memory)


@wrong("next_action", "slips: nobody is hit")
def action_that_does_not_catch_the_door(seen, memory):
    return _passing(seen, memory, catch="")


@wrong("next_action", "slips: room")
def action_that_does_not_widen_again(seen, memory):
    return _passing(seen, memory, widen=False)


@wrong("next_action", "slips: room")
def action_by_a_list(seen, memory):
    """Nothing but a list: each action follows on the one before."""
    done = memory.setdefault("done", [])
    if seen.base == "before":
        return _passing(seen, memory)
    done.append(["release", "reach", "forward", "forward", "forward"][len(done)] if len(done) < 5 else "")
    return done[-1] or _passing(seen, memory)


@wrong("next_action", "known action")
def action_of_another_robot(seen, memory):
    return "walk" if seen.base == "leaning" else _passing(seen, memory)


@wrong("next_action", "known action")
def action_with_its_reason(seen, memory):
    return _passing(seen, memory), "because"


@wrong("next_action", "by hand")
def action_tried_on_a_door_of_its_own(seen, memory):
    door = passage_door.Closer(said=seen.said)
    passage_door.pass_door(lambda seen, memory: _passing(seen, memory), door, np.random.default_rng(0))
    return _passing(seen, memory)


@wrong("next_action", "runs without an error", "error")
def action_that_breaks_the_rules_of_what_is_seen(seen, memory):
    seen.angle = 90.0
    return "forward"


@wrong("next_action", "tools left alone")
def action_with_a_wider_way(seen, memory):
    passage_door.ROOM = 0.0
    return _passing(seen, memory)
