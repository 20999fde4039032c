"""A study: many runs of experiments that differ in some settings and seeds, and what they say together.

study file -> cells (settings that differ) x seeds -> addresses -> what the store has not yet -> runs, side by side
-> store -> tidy table -> groups, paired differences -> figures and page (``plots``, ``report``)

Runs are deterministic and addressed by everything they depend on, so that a study gives the same table whatever the
engine, the number of workers and the interruptions.
"""
