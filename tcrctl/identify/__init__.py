"""Identification, [TCR] Sec. III.B: measured nodes -> robot parameters with error, spread and proof.

    spec, data files -> load_identification -> build_regression -> swarm -> least squares
                                                                 -> identifiability, held-out error
                                                                 -> report, figure, robot file

Symbols of (10): ζ the parameters, q̄ the model's positions, q̂ the measured ones. Everywhere below, ``x``
is ζ mapped to the unit interval of its bounds, followed by the unknowns of the measurement frame.
"""
