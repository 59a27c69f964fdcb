# Every target only calls the bootstrap, which works without make too (see README).
PYTHON ?= python3

.PHONY: setup run test bench

setup run test bench:
	@$(PYTHON) packaging/bootstrap.py $@ $(ARGS)
