"""What chooses the next direction: scikit-optimize as the paper would use it, our variant of it, and the peers.

All speak the same three words, `ask() -> c (5,)`, `tell(c, cost, seconds)` and `best() -> c (5,)`, and all minimise.
`best` is the best *estimated* point where there is an estimate: the visited one with the lowest posterior mean.
"""

import warnings
from typing import Protocol

import numpy as np
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from tutorialbot.bo.space import twist_features
from tutorialbot.errors import one_of
from tutorialbot.seeding import numpy_global

CANDIDATES, NEIGHBOURS = 2000, 900  # points among which `TwistSearch` maximises its acquisition function
REFIT_EVERY = 5
DIMENSIONS = 5


class Optimizer(Protocol):
    """The three words of every optimiser."""

    def ask(self) -> np.ndarray:
        """Return the next point (5,) of the cube."""

    def tell(self, c: np.ndarray, cost: float, seconds: float) -> None:
        """Take the cost of c (5,), which took so many seconds to measure."""

    def best(self) -> np.ndarray:
        """Return the best point (5,) as far as is known."""


class RandomSearch:
    """Uniform in the cube: the control."""

    def __init__(self, rng: np.random.Generator):
        self.rng = rng
        self.points: list[np.ndarray] = []
        self.costs: list[float] = []

    def ask(self) -> np.ndarray:
        """Return a point drawn uniformly."""
        return self.rng.uniform(-1.0, 1.0, DIMENSIONS)

    def tell(self, c: np.ndarray, cost: float, seconds: float) -> None:
        """Keep the point and its cost."""
        self.points.append(np.asarray(c, dtype=float))
        self.costs.append(float(cost))

    def best(self) -> np.ndarray:
        """Return the best observed point."""
        return self.points[int(np.argmin(self.costs))]


class TwistSearch(RandomSearch):
    """Expected improvement on a Gaussian process over what a point *does*, `twist_features`, instead of its
    coordinates.

    scikit-learn's Gaussian process under scikit-optimize's acquisition function; the feature map alone is ours. The
    length scale is fitted anew after every fifth point; the acquisition is maximised over random points and neighbours
    of the best three.
    """

    def __init__(self, rng: np.random.Generator, initial: int = 5):
        super().__init__(rng)
        self.initial = initial
        self._kernel = ConstantKernel(1.0, "fixed") * Matern(0.8, (0.2, 3.0), nu=2.5)

    def model(self):
        """Return the Gaussian process fitted to all points; it lives on `twist_features`."""
        from skopt.learning import GaussianProcessRegressor

        refit = len(self.costs) % REFIT_EVERY == 0
        model = GaussianProcessRegressor(
            self._kernel, alpha=1e-2, normalize_y=True, optimizer="fmin_l_bfgs_b" if refit else None
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a length scale at its bound is no news
            model.fit(twist_features(np.array(self.points)), np.array(self.costs))
        self._kernel = model.kernel_
        return model

    def acquisition(self, model, c: np.ndarray) -> np.ndarray:
        """Return the expected improvement (n,) of points c (n, 5) over the best cost so far."""
        from skopt.acquisition import gaussian_ei

        return gaussian_ei(twist_features(c), model, np.min(self.costs))

    def ask(self) -> np.ndarray:
        """Return a random point at first, then the candidate with the largest expected improvement."""
        if len(self.points) < self.initial:
            return super().ask()
        best = np.array(self.points)[np.argsort(self.costs)[:3]]
        scale = np.repeat([0.05, 0.15, 0.4], NEIGHBOURS // 3)[:, None]
        near = best[self.rng.integers(len(best), size=NEIGHBOURS)] + scale * self.rng.standard_normal(
            (NEIGHBOURS, DIMENSIONS)
        )
        candidates = np.vstack([self.rng.uniform(-1.0, 1.0, (CANDIDATES, DIMENSIONS)), np.clip(near, -1.0, 1.0)])
        return candidates[int(np.argmax(self.acquisition(self.model(), candidates)))]

    def best(self) -> np.ndarray:
        """Return the visited point with the lowest posterior mean."""
        if len(self.points) <= self.initial:
            return super().best()
        return self.points[int(np.argmin(self.model().predict(twist_features(np.array(self.points)))))]


class SkoptSearch(RandomSearch):
    """scikit-optimize's own Gaussian-process optimiser on the plain coordinates c, as a reader of the paper would use
    it.

    `acquisition` is "PI" (the probability of improvement, which the paper names), "EI" or "EIps" (expected improvement
    per second).
    """

    def __init__(self, rng: np.random.Generator, acquisition: str = "PI", initial: int = 4):
        import skopt

        super().__init__(rng)
        self.acquisition_name = one_of("acquisition", acquisition, ("PI", "EI", "EIps"))
        self._optimizer = skopt.Optimizer(
            [(-1.0, 1.0)] * DIMENSIONS,
            "GP",
            n_initial_points=initial,
            acq_func=acquisition,
            acq_optimizer="sampling",
            acq_optimizer_kwargs={"n_points": CANDIDATES},
            random_state=int(rng.integers(2**31)),
        )

    def ask(self) -> np.ndarray:
        """Return scikit-optimize's proposal."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return np.array(self._optimizer.ask())

    def tell(self, c: np.ndarray, cost: float, seconds: float) -> None:
        """Pass the cost on; "EIps" gets the logarithm-safe time too."""
        super().tell(c, cost, seconds)
        outcome = (float(cost), max(float(seconds), 1e-3)) if self.acquisition_name == "EIps" else float(cost)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._optimizer.tell(np.asarray(c, dtype=float).tolist(), outcome)

    def best(self) -> np.ndarray:
        """Return the visited point with the lowest posterior mean, once there is a model."""
        if not self._optimizer.models:
            return super().best()
        inside = self._optimizer.space.transform([point.tolist() for point in self.points])
        model = self._optimizer.models[-1]
        model = model.estimators_[0] if self.acquisition_name == "EIps" else model
        return self.points[int(np.argmin(model.predict(inside)))]


class CmaEs(RandomSearch):
    """DEAP's CMA-ES with five individuals a generation."""

    def __init__(self, rng: np.random.Generator, size: int = 5, sigma: float = 0.5):
        from deap import base, cma

        class Minimize(base.Fitness):
            weights = (-1.0,)

        class Individual(list):
            def __init__(self, values):
                super().__init__(values)
                self.fitness = Minimize()

        super().__init__(rng)
        self._make = Individual
        self._strategy = cma.Strategy([0.0] * DIMENSIONS, sigma, lambda_=size)
        self._waiting: list = []
        self._measured: list = []

    def ask(self) -> np.ndarray:
        """Return the next individual of the generation, clipped to the cube."""
        if not self._waiting:
            with numpy_global(self.rng):
                self._waiting = self._strategy.generate(lambda values: self._make(np.clip(values, -1.0, 1.0)))
        return np.array(self._waiting[0])

    def tell(self, c: np.ndarray, cost: float, seconds: float) -> None:
        """Keep the cost; a whole generation moves the distribution."""
        super().tell(c, cost, seconds)
        if not self._waiting or not np.array_equal(self._waiting[0], c):
            return  # a point that did not come from here
        individual = self._waiting.pop(0)
        individual.fitness.values = (float(cost),)
        self._measured.append(individual)
        if not self._waiting:
            self._strategy.update(self._measured)
            self._measured = []


class OptunaSearch(RandomSearch):
    """Optuna's Gaussian-process sampler, five random points first."""

    def __init__(self, rng: np.random.Generator, initial: int = 5):
        import optuna

        super().__init__(rng)
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sampler = optuna.samplers.GPSampler(
                seed=int(rng.integers(2**31)), n_startup_trials=initial, deterministic_objective=True
            )
        self._study = optuna.create_study(sampler=sampler)
        self._axes = {f"c{i + 1}": optuna.distributions.FloatDistribution(-1.0, 1.0) for i in range(DIMENSIONS)}
        self._create = optuna.trial.create_trial

    def ask(self) -> np.ndarray:
        """Return the sampler's proposal; the study learns of it in `tell`."""
        trial = self._study.ask(self._axes)
        return np.array([trial.params[name] for name in self._axes])

    def tell(self, c: np.ndarray, cost: float, seconds: float) -> None:
        """Add a finished trial to the study."""
        super().tell(c, cost, seconds)
        params = {name: float(value) for name, value in zip(self._axes, c, strict=True)}
        self._study.add_trial(self._create(params=params, distributions=self._axes, value=float(cost)))


OPTIMIZERS = {
    "twist": TwistSearch,
    "skopt": SkoptSearch,
    "random": RandomSearch,
    "cmaes": CmaEs,
    "optuna": OptunaSearch,
}
