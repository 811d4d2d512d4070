"""What the papers claim beside what we measured: the table *paper vs ours vs peers*, and the README's table."""

import csv
import math
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import pandas as pd

from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue, finite_number
from tutorialbot.paths import DATA, NOTEBOOKS, REFERENCE, ROOT
from tutorialbot.runs import RunRecord

COLUMNS = ("paper", "where", "quantity", "value", "unit", "tolerance", "reason")
BOUNDS = ("min", "max")
LAST = "end"  # of the table: this row counts those above it, so that a file cut short is noticed
README = ROOT / "README.md"
BEGIN, END = "<!-- results: begin -->", "<!-- results: end -->"


@dataclass(frozen=True)
class Page:
    """A notebook, the paper that it reproduces, and the record in data/reference/ that holds its result."""

    notebook: str
    paper: str
    record: str


PAGES = {
    1: Page("01_door_opening.ipynb", "Door opening by Bayesian optimisation", "door.json"),
    2: Page("02_cleaning_arm.ipynb", "A cleaning arm by a genetic algorithm", "ga.json"),
    3: Page("03_vox2c_space.ipynb", "Vox2C-space: the C-space from voxels", "vox2c.json"),
    4: Page("04_door_passage.ipynb", "Door passage, singularity-consistent", "sc.json"),
}


def paper_values(paper: int, path: Path = DATA / "paper_values.csv") -> pd.DataFrame:
    """Return every number that `paper` (1 to 4) states, indexed by quantity.

    Columns: where, value (float), unit, tolerance ("" for a setting; a number: agrees within +-; "min", "max": agrees
    when ours is at least, at most the value) and reason. Raises InvalidValue for another paper and BrokenFile for a
    table that is damaged or cut short.
    """
    if type(paper) is not int or paper not in (1, 2, 3, 4):
        raise InvalidValue("paper", paper, "1, 2, 3 or 4")
    rows = _read(path)
    table = pd.DataFrame([row for row in rows if row["paper"] == str(paper)], columns=COLUMNS)
    table["value"] = table["value"].astype(float)
    return table.drop(columns="paper").set_index("quantity")


def _read(path: Path) -> list[dict[str, str]]:
    try:
        with open(path, newline="", encoding="utf-8") as file:
            reader = csv.reader(file, strict=True)
            header, rows = next(reader, []), list(reader)
    except (OSError, csv.Error, UnicodeDecodeError) as error:
        raise BrokenFile(f"{path}: cannot be read: {error}") from None
    if tuple(header) != COLUMNS:
        raise BrokenFile(f"{path}: line 1 is damaged: expected {','.join(COLUMNS)}, found {','.join(header)}")
    if not rows or not path.read_bytes().endswith(b"\n"):
        raise BrokenFile(f"{path}: cut short after {len(rows)} rows")
    claims = rows[:-1] if rows[-1][:1] == [LAST] else rows
    for number, row in enumerate(claims, start=2):
        problem = _problem(row)
        if problem:
            raise BrokenFile(f"{path}: row {number} is damaged: {problem}")
    if claims is rows or rows[-1][3] != str(len(claims)):
        raise BrokenFile(f"{path}: cut short: no last row that counts the {len(claims)} rows above it")
    return [dict(zip(COLUMNS, row, strict=True)) for row in claims]


def _problem(row: list[str]) -> str:
    """Return what is wrong with a row of the table, "" if nothing is."""
    if len(row) != len(COLUMNS):
        return f"expected {len(COLUMNS)} columns, found {len(row)}"
    paper, where, quantity, value, _, tolerance, reason = row
    if paper not in ("1", "2", "3", "4") or not where or not quantity or not reason:
        return "paper, where, quantity and reason must be filled in"
    try:
        numbers = float(value), float(tolerance if tolerance not in ("", *BOUNDS) else 0)
        if not all(map(math.isfinite, numbers)):
            raise ValueError
    except ValueError:
        found = f"value = {value!r}, tolerance = {tolerance!r}"
        return f"{found}: expected a number (tolerance also min, max or nothing)"
    return ""


def verdict(ours: float, value: float, tolerance: str) -> str:
    """Return "agrees" or "differs" by the tolerance of `paper_values`, and "setting" where there is none."""
    if tolerance == "":
        return "setting" if ours == value else "setting, changed"
    if tolerance in BOUNDS:
        agrees = ours >= value if tolerance == "min" else ours <= value
    else:
        agrees = abs(ours - value) <= float(tolerance) + 1e-12
    return "agrees" if agrees else "differs"


def compare(paper: int, ours: dict[str, float], peers: dict[str, dict[str, float]] | None = None) -> pd.DataFrame:
    """Return the table of those quantities that `ours` or one of the `peers` measured, in the paper's order.

    Columns: quantity, unit, paper, ours, one a peer, verdict (of ours) and reason (of the tolerance). Raises
    InvalidValue for a quantity that the paper does not state, InvalidType or InvalidValue for one that is no number.
    """
    peers, claims = {} if peers is None else peers, paper_values(paper)
    if not isinstance(peers, dict):
        raise InvalidType("peers", peers, "a dict name -> dict quantity -> number")
    taken = {"quantity", "unit", "paper", "ours", "verdict", "reason"} & set(peers)
    if taken:
        raise InvalidValue("peers", sorted(taken), "names that are no column of the table itself")
    for name, found in {"ours": ours, **peers}.items():
        if not isinstance(found, dict):
            raise InvalidType(name, found, "a dict quantity -> number")
        for quantity, value in found.items():
            if quantity not in claims.index:
                near = get_close_matches(str(quantity), claims.index, n=3, cutoff=0.3) or list(claims.index[:3])
                raise InvalidValue(name, quantity, f"a quantity of paper {paper}, such as {', '.join(map(repr, near))}")
            finite_number(f"{name}[{quantity!r}]", value)
    rows = []
    for quantity, claim in claims.iterrows():
        if not any(quantity in found for found in (ours, *peers.values())):
            continue
        judged = verdict(ours[quantity], claim.value, claim.tolerance) if quantity in ours else "not measured"
        rows.append(
            {"quantity": quantity, "unit": claim.unit, "paper": claim.value, "ours": ours.get(quantity)}
            | {name: found.get(quantity) for name, found in peers.items()}
            | {"verdict": judged, "reason": claim.reason}
        )
    return pd.DataFrame(rows, columns=["quantity", "unit", "paper", "ours", *peers, "verdict", "reason"])


def readme_table() -> str:
    """Return the README's table notebook -> paper -> measured result, from the records in data/reference/.

    A notebook is listed when it exists. Its result is the sentence that its record keeps under "summary".
    """
    lines = ["| notebook | paper | what we measured |", "|---|---|---|"]
    for number, page in PAGES.items():
        if not (NOTEBOOKS / page.notebook).exists():
            continue
        path = REFERENCE / page.record
        summary = RunRecord.load(path).values.get("summary") if path.exists() else "not measured yet"
        if not isinstance(summary, str) or not summary or "|" in summary or "\n" in summary:
            raise BrokenFile(f"{path}: values['summary'] = {summary!r}: expected a line of text")
        lines.append(f"| [{page.notebook}](notebooks/{page.notebook}) | {number}. {page.paper} | {summary} |")
    return "\n".join(lines)


def with_table(text: str, table: str) -> str:
    """Return the text of a README with `table` between the two markers; raises BrokenFile when a marker is missing."""
    head, begin, rest = text.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not begin or not end:
        raise BrokenFile(f"README.md: the markers {BEGIN} and {END} must both be there")
    return f"{head}{BEGIN}\n{table}\n{END}{tail}"


def write_readme() -> None:
    """Put the table of now into README.md."""
    README.write_text(with_table(README.read_text(encoding="utf-8"), readme_table()), encoding="utf-8")
