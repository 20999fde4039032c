"""Self-calibration: the log of an excitation -> robot file and calibration file, with certainty.

    log -> rests -> unknowns, body -> shapes at rest and their slopes -> sight -> fit -> report, files
                                      design: which poses tell most, before anything is measured

Symbols: x the unknowns, all zero for the robot as described; each has a prior standard deviation.
"""  # fmt: skip
