"""Draw the picture of the README: python docs/draw_letter.py LOG docs/letter_t.png."""

from __future__ import annotations

import sys
from pathlib import Path

from tcrctl.analysis.history import read_histories
from tcrctl.plots import draw, save

if __name__ == "__main__":
    log, picture = map(Path, sys.argv[1:])
    save(draw("overview", read_histories([log])), picture)
