"""The exercises' checks: `from tutorialbot.checks import door`, then `door.direction.check(my_function)`."""
