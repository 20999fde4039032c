"""Tasks: what a run is for, beyond following its trajectory; one file per kind, settings in ``settings.py``."""
