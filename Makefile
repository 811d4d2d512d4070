# Thin: every target is a verb of `python3 -m tutorialbot`.
.PHONY: lab test full run doctor bench strip
lab test run doctor strip:
	python3 -m tutorialbot $@
full:
	python3 -m tutorialbot test --full
bench:
	python3 -m tutorialbot bench door
