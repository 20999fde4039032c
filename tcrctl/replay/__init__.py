"""Replay: the controller of a log, rebuilt and fed with what was recorded, must do the same again, bit for bit.

log: attachments -> rebuild -> estimator, controller -+
log: steps -> plant.recorded -------------------------+-> loop -> comparison -> Replay
"""
