"""Trajectories: t -> Reference; one file per kind, settings in ``settings.py``."""
