"""The control loop: the tick, when it begins, when it must stop, and a quiet interpreter round it."""
