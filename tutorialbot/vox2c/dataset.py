"""Pairs of voxels and C-space (paper 3, section 4.1.2): made once, on all cores, in files that survive an interrupt.

Scenes are numbered by their seeds. CHUNK scenes make a file of voxels and a file of labels, so voxels are shared by all
resolutions. Files are made whole or not at all; the next run makes what is missing or damaged, and nothing else.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from tutorialbot import paths
from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, one_of, whole_number
from tutorialbot.runs import progress
from tutorialbot.vox2c import grids, labels, shards
from tutorialbot.vox2c.scenes import random_scene

CHUNK = 250  # scenes in a file
SPLITS = {"train": 1_000_000, "validation": 2_000_000, "test": 3_000_000}  # first seeds: the splits never meet
LARGEST = 1_000_000  # scenes in a split
SMALL = {"train": 500, "validation": 250, "test": 250}  # scenes that are committed, in data/vox2c


@dataclass(frozen=True)
class Recipe:
    """What a pair is: voxels of `source` and `size` (see grids.voxelize), and labels at `resolution_deg`.

    labels: "exact", of the boxes, or "octree", of these voxels, as in the paper. Raises InvalidValue or InvalidType.
    """

    resolution_deg: float = 5
    source: str = "cameras"
    size: int = 32
    labels: str = "exact"

    def __post_init__(self):
        labels.cells(self.resolution_deg)
        one_of("source", self.source, grids.SOURCES)
        one_of("labels", self.labels, labels.KINDS)
        grids.check_size(self.size)

    @property
    def columns(self) -> dict[str, int]:
        """Names of the two kinds of files, voxels first, and the bytes of a row in each."""
        voxels, n = f"{self.source}-{self.size}", labels.cells(self.resolution_deg)
        kind = self.labels if self.labels == "exact" else f"{self.labels}-{voxels}"
        return {f"voxels-{voxels}": -(-(self.size**3) // 8), f"{kind}-{self.resolution_deg:g}deg": -(-(n**2) // 8)}

    def pair(self, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Make the pair of one scene: voxels bool (size, size, size), C-space bool (n, n)."""
        voxels = grids.voxelize(random_scene(seed), self.source, self.size)
        return voxels, self.cspace(seed, voxels)

    def cspace(self, seed: int, voxels: np.ndarray) -> np.ndarray:
        """Return the label, bool (n, n), of a scene and its voxels."""
        if self.labels == "octree":
            return labels.octree_cspace(voxels, self.resolution_deg)
        return labels.exact_cspace(random_scene(seed), self.resolution_deg)


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs in memory, bit-packed: seeds (k,), voxels (k, bytes) and cspaces (k, bytes), uint8, first bit lowest."""

    recipe: Recipe
    seeds: np.ndarray
    voxels: np.ndarray
    cspaces: np.ndarray

    def __len__(self) -> int:
        return len(self.seeds)

    def batch(self, index) -> tuple[np.ndarray, np.ndarray]:
        """Return voxels bool (b, size, size, size) and C-spaces bool (b, n, n) of the pairs `index` (anything that
        indexes an array along its first axis: a slice, whole numbers (b,)).
        """
        size, n = self.recipe.size, labels.cells(self.recipe.resolution_deg)
        return _unpack(self.voxels[index], (size,) * 3), _unpack(self.cspaces[index], (n, n))


def seeds(split: str, count: int) -> range:
    """Return the seeds of the first `count` scenes of a split: "train", "validation" or "test"; they never meet."""
    first = SPLITS[one_of("split", split, SPLITS)]
    if whole_number("count", count, 1) > LARGEST:
        raise InvalidValue("count", count, f"at most {LARGEST} scenes")
    return range(first, first + count)


def make(recipe: Recipe, split: str, count: int, folder: Path | None = None, *, jobs: int = 2) -> int:
    """Make the first `count` pairs of a split, in `jobs` processes with a bar; return how many files were written.

    Whole files stay as they are; missing, damaged and cut ones are made, and those that this code would fill
    otherwise (the first scene of each is made again and compared). folder: results/vox2c unless given. Interrupted, the
    same call goes on from there. Raises InvalidValue, InvalidType, or BrokenFile when the disk refuses.
    """
    _recipe(recipe)
    chunks = _chunks(seeds(split, count))
    folder = paths.results() / "vox2c" if folder is None else Path(folder)
    for column in recipe.columns:
        shards.sweep(folder / column)
    tasks = (delayed(_make_chunk)(recipe, first, folder) for first in chunks)
    written = Parallel(n_jobs=whole_number("jobs", jobs, 1), return_as="generator_unordered")(tasks)
    return sum(progress(written, total=len(chunks), description=f"{len(chunks) * CHUNK} scenes"))


def read(recipe: Recipe, split: str, count: int, folder: Path | None = None) -> Pairs:
    """Read the first `count` pairs of a split, bit-packed: at 1 degree 30,000 pairs take 0.6 GB.

    folder: by default what `make` wrote, and where there is nothing the small set of data/vox2c. Raises BrokenFile that
    names the file when one is missing, damaged or cut short: `make` makes it again.
    """
    wanted, (voxels, cspaces) = seeds(split, count), _recipe(recipe).columns
    folders = (paths.results() / "vox2c", paths.DATA / "vox2c") if folder is None else (Path(folder),)
    rows = {}
    for column, width in recipe.columns.items():
        rows[column] = np.empty((count, width), dtype=np.uint8)
        for first in _chunks(wanted):
            place = slice(first - wanted.start, min(first - wanted.start + CHUNK, count))
            rows[column][place] = _read_chunk(folders, column, width, first)[: place.stop - place.start]
    return Pairs(recipe, np.arange(wanted.start, wanted.stop), rows[voxels], rows[cspaces])


def _recipe(value: Recipe) -> Recipe:
    if not isinstance(value, Recipe):
        raise InvalidType("recipe", value, "a dataset.Recipe")
    return value


def _chunks(wanted: range) -> range:
    return range(wanted.start, wanted.stop, CHUNK)  # every split begins at a multiple of CHUNK


def _file(folder: Path, column: str, first: int) -> tuple[Path, dict]:
    about = {"holds": column, "first_seed": first, "scenes": CHUNK}
    return folder / column / f"{first}.bits", about


def _read_chunk(folders: Iterable[Path], column: str, width: int, first: int) -> np.ndarray:
    files = [_file(folder, column, first) for folder in folders]
    path, about = next((file for file in files if file[0].exists()), files[0])
    return shards.read(path, about, width)


def _make_chunk(recipe: Recipe, first: int, folder: Path) -> int:
    """Make the two files of one chunk unless they are whole; return how many were written."""
    wanted = range(first, first + CHUNK)
    (of_voxels, of_cspaces), sample = recipe.columns, recipe.pair(first)
    voxels, cspaces = (_whole(recipe, column, first, folder, sample) for column in recipe.columns)
    written = (voxels is None) + (cspaces is None)
    if voxels is None:
        made = (grids.voxelize(random_scene(seed), recipe.source, recipe.size) for seed in wanted)
        voxels = _write(folder, of_voxels, first, made)
    if cspaces is None:
        cubes = (_unpack(row, (recipe.size,) * 3) for row in voxels)
        made = (recipe.cspace(seed, cube) for seed, cube in zip(wanted, cubes, strict=True))
        _write(folder, of_cspaces, first, made)
    return written


def _whole(recipe: Recipe, column: str, first: int, folder: Path, sample: tuple) -> np.ndarray | None:
    """The rows of a file that needs not be made again, else None; sample: the pair of its first scene, as made now."""
    with suppress(BrokenFile):
        rows = _read_chunk([folder], column, recipe.columns[column], first)
        expected = _pack(sample[list(recipe.columns).index(column)])
        return rows if len(rows) == CHUNK and (rows[0] == expected).all() else None
    return None


def _write(folder: Path, column: str, first: int, made: Iterable[np.ndarray]) -> np.ndarray:
    rows = np.array([_pack(grid) for grid in made])
    path, about = _file(folder, column, first)
    shards.write(path, about, rows)
    return rows


def _pack(grid: np.ndarray) -> np.ndarray:
    return np.packbits(grid, bitorder="little")


def _unpack(rows: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    bits = np.unpackbits(rows, axis=-1, count=int(np.prod(shape)), bitorder="little")
    return bits.view(bool).reshape(*rows.shape[:-1], *shape)
