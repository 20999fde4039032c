"""Stability report: the inner iteration and the closed loop of an experiment, linearised along a simulated run."""
