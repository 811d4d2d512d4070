"""How answers are planted: decorators that note a function with the exercise it answers."""

from collections.abc import Callable

Planter = Callable[[Callable], Callable]


def wrong_into(found: list[tuple]) -> Callable[..., Planter]:
    """Return `wrong(exercise, check, outcome)`, which adds (function, exercise, check, outcome) to `found`."""

    def wrong(exercise: str, check: str, outcome: str = "incorrect") -> Planter:
        def plant(function):
            found.append((function, exercise, check, outcome))
            return function

        return plant

    return wrong


def right_into(found: list[tuple]) -> Callable[[str], Planter]:
    """Return `right(exercise)`, which adds (function, exercise) to `found`."""

    def right(exercise: str) -> Planter:
        def plant(function):
            found.append((function, exercise))
            return function

        return plant

    return right
