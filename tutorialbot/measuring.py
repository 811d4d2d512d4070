"""What benchmarks share: shares with intervals, CPU times, and studies that go on where they were interrupted."""

import time
from collections.abc import Callable, Sequence

from joblib import Parallel, delayed
from scipy.stats import binomtest

from tutorialbot.runs import Journal, progress


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share: the one that still says something at 0 and at 100 %."""
    interval = binomtest(successes, trials).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def cpu_seconds(actions: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the least of `repeats` CPU times [s] of each action, taken in turns: what disturbs one disturbs all."""
    least = dict.fromkeys(actions, float("inf"))
    for _ in range(repeats):
        for name, action in actions.items():
            began = time.process_time()
            action()
            least[name] = min(least[name], time.process_time() - began)
    return least


def run_all(
    function: Callable[..., dict], wanted: Sequence[tuple], journal: Journal, jobs: int, description: str
) -> None:
    """Call `function` with each tuple of arguments in `jobs` processes; each result is in the journal at once."""
    results = Parallel(n_jobs=jobs, return_as="generator_unordered")(delayed(function)(*item) for item in wanted)
    for result in progress(results, total=len(wanted), description=description):
        journal.append(result)
