"""Estimators: measurement and applied command -> state of the robot model; chosen by ``estimator.kind``."""
