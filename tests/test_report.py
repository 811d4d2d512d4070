"""The table of claims is whole and says what the papers say; verdicts follow its tolerances; the README is current."""

import re

import pytest

from tutorialbot import report
from tutorialbot.errors import BrokenFile, InvalidType, InvalidValue
from tutorialbot.paths import DATA
from tutorialbot.runs import RunRecord

VALUES = DATA / "paper_values.csv"

# Read off the papers a second time, by hand, for this test.
SPOT_CHECKS = {
    1: {"largest translation w": 0.15, "duration of a trial": 4, "penalty when coming back": 5,
        "sections to open a door": 6, "mass of the robot": 140, "evaluations a section": 15,
        "height of the robot without manipulators": 1.17},
    2: {"generations": 200, "probability of crossover": 0.6, "probability of mutation": 0.4,
        "pattern 3 target 4 z": 0.1, "pattern 2 target 3 y": 0.2, "pattern 1 target 1 pitch": -1.57},
    3: {"IoU at 5 deg": 0.796, "loss at 10 deg": 2.056, "planning time of the usual method, sequence 2": 8414.2,
        "data for each resolution": 30000, "channels of the reshaped features": 2048},
    4: {"phases of the motion": 8, "ratio K in roll": 0},
}  # fmt: skip


@pytest.mark.parametrize("paper", SPOT_CHECKS)
def test_claims_say_what_the_paper_says(paper):
    table = report.paper_values(paper)
    assert {quantity: table.value[quantity] for quantity in SPOT_CHECKS[paper]} == SPOT_CHECKS[paper]
    assert table.index.is_unique
    assert all(re.search(r"Abstract|[Ss]ection|Table|Fig|Algorithm|Footnote|eq\.", where) for where in table["where"])


def test_table_1_of_paper_2_is_whole():
    table = report.paper_values(2)
    rows = [q for q in table.index if re.fullmatch(r"pattern \d target \d (x|y|z|roll|pitch|yaw)", q)]
    assert len(rows) == (3 + 3 + 4) * 6


def test_the_saving_that_paper_3_states_is_that_of_the_sums():
    table = report.paper_values(3).value
    usual = [table[f"planning time of the usual method, sequence {k}"] for k in (1, 2, 3)]
    proposed = [table[f"planning time of the proposed method at 1 deg, sequence {k}"] for k in (1, 2, 3)]
    assert round(100 * (1 - sum(proposed) / sum(usual)), 1) == table["planning time saved"]


@pytest.mark.parametrize("paper", [0, 5, "1", None])
def test_there_are_four_papers(paper):
    with pytest.raises(InvalidValue, match="paper = .*: expected 1, 2, 3 or 4"):
        report.paper_values(paper)


def test_verdicts_follow_the_tolerance():
    assert [report.verdict(x, 6.0, "1") for x in (4.9, 5, 7, 7.1)] == ["differs", "agrees", "agrees", "differs"]
    assert [report.verdict(x, 0.5, "min") for x in (0.49, 0.5, 1)] == ["differs", "agrees", "agrees"]
    assert [report.verdict(x, 4.0, "max") for x in (3, 4, 4.1)] == ["agrees", "agrees", "differs"]
    assert [report.verdict(x, 4.0, "") for x in (4, 5)] == ["setting", "setting, changed"]


def test_compare_shows_ours_and_peers_in_the_papers_order():
    ours = {"sections to open a door": 7, "share of doors opened": 0.31}
    peers = {"random": {"share of doors opened": 0.2}, "optuna": {"evaluations a section": 15}}
    table = report.compare(1, ours, peers)
    assert list(table.columns) == ["quantity", "unit", "paper", "ours", "random", "optuna", "verdict", "reason"]
    assert list(table.quantity) == ["evaluations a section", "share of doors opened", "sections to open a door"]
    assert list(table.verdict) == ["not measured", "differs", "agrees"]
    assert list(table.paper) == [15, 0.5, 6] and table.random[1] == 0.2 and all(table.reason)


def test_compare_refuses_what_the_paper_does_not_state():
    with pytest.raises(InvalidValue, match="ours = 'share of doors open': .*such as 'share of doors opened'"):
        report.compare(1, {"share of doors open": 1.0})
    with pytest.raises(InvalidValue, match="random.*share of doors opened.*finite number"):
        report.compare(1, {}, {"random": {"share of doors opened": float("nan")}})
    with pytest.raises(InvalidType, match="ours = 3"):
        report.compare(1, 3)
    with pytest.raises(InvalidType, match=r"peers = \[1\]"):
        report.compare(1, {}, [1])
    with pytest.raises(InvalidValue, match="ours = 3"):
        report.compare(1, {3: 4.0})


DAMAGE = {
    "cut in a row": (lambda text: text[: len(text) // 2 + 7], "damaged|cut short"),
    "last line end missing": (lambda text: text[:-1], "cut short"),
    "cut at the end of a row": (lambda text: "".join(text.splitlines(keepends=True)[:100]), "cut short"),
    "a row lost": (lambda text: "".join(text.splitlines(keepends=True)[:50] + text.splitlines(keepends=True)[51:]),
                   "cut short"),
    "empty": (lambda text: "", "line 1 is damaged"),
    "header only": (lambda text: text.splitlines(keepends=True)[0], "cut short"),
    "no number": (lambda text: text.replace(",0.15,m,", ",wide,m,"), r"value = 'wide'"),
    "no reason": (lambda text: text + "1,Section 1,x,1,,,\n", "must be filled in"),
    "open quotes": (lambda text: text + '1,Section 1,"x,1\n', "cannot be read|columns"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_table_is_named(tmp_path, damage):
    spoil, message = DAMAGE[damage]
    path = tmp_path / "values.csv"
    path.write_text(spoil(VALUES.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(BrokenFile, match=f"values.csv: .*({message})"):
        report.paper_values(1, path)


def test_a_missing_table_is_named(tmp_path):
    with pytest.raises(BrokenFile, match="none.csv: cannot be read"):
        report.paper_values(1, tmp_path / "none.csv")


def test_the_table_of_the_readme_is_current():
    text = report.README.read_text(encoding="utf-8")
    assert text == report.with_table(text, report.readme_table()), "run `python3 -m tutorialbot report --write`"


def test_the_table_of_the_readme_comes_from_the_records(tmp_path, monkeypatch):
    for name in ("REFERENCE", "NOTEBOOKS"):
        monkeypatch.setattr(report, name, tmp_path)
    assert report.readme_table().count("\n") == 1, "a notebook that does not exist is not listed"
    (tmp_path / report.PAGES[1].notebook).touch()
    assert "not measured yet" in report.readme_table()
    record = RunRecord("door", "bench door", 1, "paper", 1.0, {"summary": "97 of 100 doors opened"})
    record.save(tmp_path / report.PAGES[1].record)
    assert report.readme_table().splitlines()[-1].endswith("| 97 of 100 doors opened |")
    record.values["summary"] = "a | b"
    record.save(tmp_path / report.PAGES[1].record)
    with pytest.raises(BrokenFile, match="summary"):
        report.readme_table()
    with pytest.raises(BrokenFile, match="markers"):
        report.with_table("# no markers", "")


def test_a_peer_cannot_take_the_place_of_a_column():
    with pytest.raises(InvalidValue, match=r"peers = \['paper'\]"):
        report.compare(1, {"sections to open a door": 6}, {"paper": {"sections to open a door": 7}})
    with pytest.raises(InvalidValue, match="such as 'dimensions of the search space'"):
        report.compare(1, {"~": 6})
