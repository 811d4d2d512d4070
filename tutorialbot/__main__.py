"""The command line: `python3 -m tutorialbot VERB`. Standard library only; the verbs' own imports come later."""

import argparse
import sys

from tutorialbot import launch

VERBS = {
    "lab": "open the notebooks in JupyterLab, at the first page (further options go to JupyterLab)",
    "test": "run every test: ruff, pytest, and all notebooks (--full: heavy and browser tests too)",
    "run": "run all notebooks without a browser and write them as HTML into results/",
    "doctor": "check this machine, one line each, and say what to do",
    "report": "print the table paper vs ours for every finished notebook (--write: refresh README.md)",
    "bench": "measure, and write JSON: `bench NAME` (further options go to the benchmark)",
    "train": "train a network of paper 3: `train vox2c`, `train linkframe` (further options go to the training)",
    "grade": "mark a folder of students' submissions: `grade FOLDER` (further options go to the grader)",
    "strip": "remove outputs from the notebooks, as it must be before a commit",
}
HANDING_ON = ("lab", "bench", "train", "grade")  # options that are not ours go to the program behind the verb


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the verbs and of those options that are ours."""
    parser = argparse.ArgumentParser(prog="python3 -m tutorialbot", description="Robotics papers as notebooks.")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB")
    verbs.required = True
    made = {
        name: verbs.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        for name, text in VERBS.items()
    }
    made["test"].add_argument("--full", action="store_true", help="heavy tests too; whatever is missing is a failure")
    made["run"].add_argument("--fresh", action="store_true", help="run again what is already done")
    made["report"].add_argument("--write", action="store_true", help="refresh the table in README.md")
    made["bench"].add_argument("name", metavar="NAME", help="which: " + ", ".join(launch.BENCHMARKS) + ", or all")
    made["train"].add_argument("name", metavar="NAME", help="which network: vox2c, linkframe")
    made["grade"].add_argument("folder", metavar="FOLDER", help="one file or folder for each student")
    return parser


def main(argv: "list[str]") -> int:
    """Set up if needed, go inside the environment, do what `argv` says; returns the exit status."""
    own = argv[:2] if argv[:1] in (["bench"], ["train"], ["grade"]) else argv
    options, further = make_parser().parse_known_args(own)
    further += argv[len(own) :]
    if further and options.verb not in HANDING_ON:
        make_parser().error("unknown option for {}: {}".format(options.verb, " ".join(further)))
    if options.verb == "doctor" and not launch.stands(launch.ROOT / ".venv", launch.ROOT):
        from tutorialbot import doctor

        fit = doctor.examine(doctor.MACHINE)
        print("note  packages  not installed yet: `python3 -m tutorialbot lab` does it")
        return int(not fit)
    launch.enter(argv)
    from tutorialbot import commands

    return commands.run_verb(options, further)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
