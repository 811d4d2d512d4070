"""The exercises' checks: `from tutorialbot.checks import door`, then `door.lengths.check(my_function)`."""
