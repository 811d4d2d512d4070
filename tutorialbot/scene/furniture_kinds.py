"""The kinds of furniture: the boxes, cylinders and cushions that each is made of.

A kind is drawn in its own frame: origin on the floor in the middle of its footprint, x along its length, y along its
width with the front (of a sofa, a cupboard) toward -y, z up.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

COLOURS = {
    "wood": (0.66, 0.47, 0.30), "dark_wood": (0.42, 0.28, 0.19), "white": (0.93, 0.93, 0.91),
    "cloth": (0.33, 0.45, 0.58), "cushion": (0.44, 0.57, 0.70), "yellow": (0.90, 0.72, 0.28),
    "sheet": (0.95, 0.95, 0.97), "blanket": (0.36, 0.55, 0.50), "carpet": (0.76, 0.62, 0.50),
    "carpet_edge": (0.60, 0.36, 0.30), "leaf": (0.25, 0.52, 0.27), "pot": (0.76, 0.45, 0.33),
    "black": (0.10, 0.11, 0.13), "metal": (0.70, 0.72, 0.75), "screen": (0.12, 0.16, 0.22),
    "red": (0.72, 0.25, 0.22), "lamp": (0.99, 0.93, 0.76), "floor": (0.80, 0.68, 0.53), "seam": (0.66, 0.53, 0.39),
    "wall": (0.90, 0.89, 0.86), "skirting": (0.98, 0.98, 0.97),
}  # fmt: skip


@dataclass(frozen=True)
class Part:
    """A shape in the frame of its piece: centre and half sizes (3,) [m], and what it is for.

    `shape` is "box", "cylinder", "egg", "cushion" or "mattress"; what is solid is a box or a cylinder.
    `material` is a name in COLOURS, or None for what is not seen; what is `solid` stops the robot.
    """

    shape: str
    centre: tuple[float, float, float]
    half: tuple[float, float, float]
    material: str | None
    solid: bool = True


def _box(x, y, z, a, b, c, material, solid=True) -> Part:
    """A box from its centre and its whole sizes."""
    return Part("box", (x, y, z), (a / 2, b / 2, c / 2), material, solid)


def _post(x, y, radius, low, high, material, solid=True) -> Part:
    return Part("cylinder", (x, y, (low + high) / 2), (radius, radius, (high - low) / 2), material, solid)


def _soft(x, y, z, a, b, c, material) -> Part:
    """A cushion: seen, and no more."""
    return Part("cushion", (x, y, z), (a / 2, b / 2, c / 2), material, False)


def _table(a, b, c) -> list[Part]:
    leg = 0.05
    x, y = a / 2 - leg, b / 2 - leg
    legs = [_box(i * x, j * y, (c - 0.03) / 2, leg, leg, c - 0.03, "dark_wood") for i in (-1, 1) for j in (-1, 1)]
    rails = [_box(0, j * y, c - 0.06, 2 * x, 0.02, 0.06, "dark_wood") for j in (-1, 1)]
    return [_box(0, 0, c - 0.015, a, b, 0.03, "wood"), *legs, *rails]


def _chair(a, b, c) -> list[Part]:
    leg, seat = 0.035, 0.52 * c
    x, y = a / 2 - leg / 2, b / 2 - leg / 2
    legs = [_box(i * x, -y, seat / 2, leg, leg, seat, "dark_wood") for i in (-1, 1)]
    legs += [_box(i * x, y, c / 2, leg, leg, c, "dark_wood") for i in (-1, 1)]
    back = [_box(0, y, h * c, a - 2 * leg, 0.018, 0.09 * c, "wood") for h in (0.72, 0.92)]
    return [
        *legs,
        *back,
        _box(0, 0, seat, a, b, 0.03, "wood"),
        _soft(0, 0, seat + 0.015, 0.9 * a, 0.85 * b, 0.05, "yellow"),
    ]


def _sofa(a, b, c) -> list[Part]:
    arm, back, seat = 0.09 * a, 0.22 * b, 0.52 * c
    width = (a - 2 * arm) / 2
    solid = [
        _box(0, 0, seat / 2 + 0.02, a, b, seat - 0.04, None),
        _box(0, b / 2 - back / 2, c / 2 + 0.02, a, back, c - 0.04, None),
        *(_box(i * (a - arm) / 2, 0, 0.36 * c + 0.02, arm, b, 0.72 * c - 0.04, None) for i in (-1, 1)),
    ]
    seen = [
        _box(0, 0.01, 0.19 * c, a - 0.02, b - 0.04, 0.26 * c, "cloth", False),
        _soft(0, b / 2 - back / 2, 0.53 * c, a - arm, back, 0.94 * c, "cloth"),
        *(_soft(i * (a - arm) / 2, 0, 0.37 * c, arm, b, 0.7 * c, "cloth") for i in (-1, 1)),
        *(_soft(i * width / 2, -back / 2, seat - 0.12 * c, width, b - back, 0.24 * c, "cushion") for i in (-1, 1)),
        *(_soft(i * width / 2, b / 2 - back, 0.68 * c, 0.94 * width, 0.24 * b, 0.44 * c, "cushion") for i in (-1, 1)),
        _soft(-0.62 * width, -0.02 * b, seat + 0.1 * c, 0.34 * width, 0.12 * b, 0.32 * c, "yellow"),
        *(
            _post(i * (a / 2 - 0.06), j * (b / 2 - 0.06), 0.02, 0, 0.06, "dark_wood", False)
            for i in (-1, 1)
            for j in (-1, 1)
        ),
    ]
    return solid + seen


def _bed(a, b, c) -> list[Part]:
    top, foot, head = 0.5 * c, a / 2, -a / 2
    solid = [_box(0.02, 0, top / 2, a - 0.04, b, top, None), _box(head + 0.02, 0, c / 2, 0.04, b, c, "dark_wood")]
    feet = [
        _post(i * (a / 2 - 0.08), j * (b / 2 - 0.06), 0.025, 0, 0.06, "dark_wood") for i in (-1, 1) for j in (-1, 1)
    ]
    seen = [
        _box(0.02, 0, 0.18 * c, a - 0.04, b - 0.01, 0.2 * c, "wood", False),
        Part("mattress", (0.01, 0, 0.36 * c), (a / 2 - 0.05, b / 2 - 0.03, 0.13 * c), "sheet", False),
        Part("mattress", (0.18 * a, 0, 0.37 * c), (foot - 0.18 * a - 0.01, b / 2 - 0.005, 0.13 * c), "blanket", False),
        _soft(head + 0.13 * a, 0, top - 0.01, 0.16 * a, 0.62 * b, 0.16 * c, "sheet"),
    ]
    return [*solid, *seen, *(replace(post, solid=False) for post in feet)]


def _cupboard(a, b, c) -> list[Part]:
    doors = max(1, round(a / 0.45))
    wide, front = a / doors, -b / 2
    seen = [
        _box(0, 0.01, 0.03, a - 0.04, b - 0.02, 0.06, "black", False),
        _box(0, 0, c / 2 + 0.03, a, b - 0.02, c - 0.06, "wood", False),
    ]
    for i in range(doors):
        x = (i + 0.5) * wide - a / 2
        seen.append(_box(x, front + 0.006, c / 2 + 0.03, wide - 0.015, 0.012, c - 0.09, "white", False))
        side = -1 if i % 2 else 1
        seen.append(_box(x + side * (wide / 2 - 0.05), front + 0.001, 0.55 * c, 0.012, 0.016, 0.12, "metal", False))
    return [_box(0, 0, c / 2, a, b, c, None), *seen]


def _bookcase(a, b, c) -> list[Part]:
    boards = max(2, round(c / 0.32))
    step = (c - 0.05) / boards
    seen = [_box(i * (a / 2 - 0.01), 0, c / 2, 0.02, b, c, "wood", False) for i in (-1, 1)]
    seen += [_box(0, b / 2 - 0.007, c / 2, a - 0.002, 0.01, c - 0.002, "dark_wood", False)]
    seen += [_box(0, -0.007, 0.04 + i * step, a - 0.02, b - 0.018, 0.02, "wood", False) for i in range(boards + 1)]
    for i in range(boards):
        at, low = 0.03 - a / 2, 0.05 + i * step
        for j, material in enumerate(("red", "blanket", "yellow", "cloth", "white", "red", "cushion")[i % 3 :]):
            wide, high = (0.055 + 0.02 * ((3 * i + 2 * j) % 4)) * a, step * (0.62 + 0.07 * ((i + 2 * j) % 4))
            seen.append(_box(at + wide / 2, 0.02 * b, low + high / 2, wide - 0.004, 0.75 * b, high, material, False))
            at += wide
    return [_box(0, 0, c / 2, a, b, c, None), *seen]


def _television(a, b, c) -> list[Part]:
    low = 0.42 * c
    return [
        *_cupboard(a, b, low),
        _box(0, 0.1 * b, (low + c) / 2, 0.8 * a, 0.12 * b, c - low, None),
        _box(0, 0.1 * b, low + 0.03, 0.25 * a, 0.1 * b, 0.06, "black", False),
        _box(0, 0.1 * b, (low + c) / 2 + 0.02, 0.8 * a, 0.1 * b, c - low - 0.06, "black", False),
        _box(0, 0.048 * b, (low + c) / 2 + 0.02, 0.77 * a, 0.01 * b, c - low - 0.1, "screen", False),
    ]


def _plant(a, b, c) -> list[Part]:
    radius, pot = a / 2, 0.36 * c
    leaves = [
        Part(
            "egg",
            (r * radius * np.cos(t), r * radius * np.sin(t), z * c),
            (0.42 * radius, 0.42 * radius, 0.12 * c),
            "leaf",
            False,
        )
        for r, z, t in [
            (0, 0.86, 0),
            *((0.5, 0.62 + 0.04 * (i % 3), 1.26 * i) for i in range(5)),
            *((0.3, 0.76, 2.1 * i + 0.5) for i in range(3)),
        ]
    ]
    return [
        Part("cylinder", (0, 0, c / 2), (radius, radius, c / 2), None, True),
        _post(0, 0, 0.8 * radius, 0, pot, "pot", False), _post(0, 0, 0.86 * radius, pot - 0.03, pot, "pot", False),
        _post(0, 0, 0.06 * radius, pot, 0.7 * c, "dark_wood", False), *leaves,
    ]  # fmt: skip


def _lamp(a, b, c) -> list[Part]:
    radius = a / 2
    return [
        _post(0, 0, radius, 0, 0.03, "black"), _post(0, 0, 0.014, 0.03, 0.8 * c, "metal"),
        _post(0, 0, 0.9 * radius, 0.78 * c, c, "lamp"),
    ]  # fmt: skip


def _pillar(a, b, c) -> list[Part]:
    return [_post(0, 0, a / 2, 0, c, "white"), _post(0, 0, a / 2 + 1e-3, 0, 0.08, "skirting", False)]


def _carton(a, b, c) -> list[Part]:
    return [_box(0, 0, c / 2, a, b, c, "wood"), _box(0, 0, c - 0.001, a + 0.002, 0.05, 0.004, "carpet", False)]


def _carpet(a, b, c) -> list[Part]:
    return [
        _box(0, 0, 0.3 * c, a, b, 0.6 * c, "carpet_edge", False),
        _box(0, 0, c / 2, a - 0.12, b - 0.12, c, "carpet", False),
    ]


KINDS: dict[str, tuple[tuple[float, float, float], Callable[[float, float, float], list[Part]]]] = {
    "table": ((1.2, 0.7, 0.72), _table),
    "chair": ((0.42, 0.42, 0.86), _chair),
    "sofa": ((1.7, 0.8, 0.78), _sofa),
    "bed": ((2.0, 1.0, 0.9), _bed),
    "cupboard": ((0.9, 0.45, 1.1), _cupboard),
    "bookcase": ((0.8, 0.28, 1.3), _bookcase),
    "television": ((1.2, 0.4, 1.1), _television),
    "plant": ((0.36, 0.36, 0.9), _plant),
    "lamp": ((0.3, 0.3, 1.45), _lamp),
    "pillar": ((0.3, 0.3, 1.5), _pillar),
    "carton": ((0.4, 0.3, 0.3), _carton),
    "carpet": ((1.6, 1.1, 0.006), _carpet),
}
