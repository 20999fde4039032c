"""Run five experiments and photograph their reports: python docs/draw_reports.py [NAME...] (some minutes).

Each report is shown as it opens, 1400 and 400 px wide, in docs/reports/NAME_WIDTH.png. Needs Chromium.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from PIL import Image

from tcrctl.config.shipped import find_rig

TCRCTL: Final = [sys.executable, "-m", "tcrctl.cli.app"]
RIG: Final = "bench.yaml"
#: A computer that also draws pictures does not keep up with cameras, drives and controller; the bench is patient.
PATIENT: Final = (
    "safety: {stale_after_ms: 1000, stale_stop_ms: 4000, silence_stop_ms: 4000, following_mm: 20}"
)
#: The algorithm as it is printed, which a safety limit stops.
STOPPED: Final = [
    part
    for setting in ("controller.prediction=literal", "controller.tension=off", "controller.integral=off")
    for part in ("--set", setting)
]
#: One short stroke: a busy computer need not keep up for long.
SHORT: Final = [
    part
    for setting in (
        "trajectory.strokes=[{line: [[-10, 0], [10, 0]]}]",
        "trajectory.plane.offset_mm=[0, 0, 6]",
    )
    for part in ("--set", setting)
]
#: Picture -> arguments of ``tcrctl run``.
RUNS: Final = {
    "letter_t": ["letter_t"],
    "box_scan": ["box_scan"],
    "laser_pipe": ["laser_pipe"],
    "aborted": ["letter_t", *STOPPED],
    "bench": ["letter_i", *SHORT, "--set", "plant.kind=rig", "--yes"],
}
#: Width of the page -> size of the window; Chromium has none below 500 px, so the page is made narrow in it.
SIZES: Final = {1400: (1400, 1000), 400: (500, 2400)}
COLOURS: Final = 64


def main(names: list[str]) -> None:
    """Make every picture, or those that are named."""
    folder = Path(__file__).with_name("reports")
    folder.mkdir(exist_ok=True)
    for name in names or RUNS:
        with TemporaryDirectory() as made:
            page = report(name, Path(made))
            for width, size in SIZES.items():
                photograph(page, width, size, folder / f"{name}_{width}.png")


def report(name: str, out: Path) -> Path:
    """Run an experiment, which may be stopped or fail, and return its page."""
    with emulator(out / RIG) if name == "bench" else nullcontext():
        rig = ["--set", f"plant.rig={out / RIG}"] if name == "bench" else []
        subprocess.run([*TCRCTL, "run", *RUNS[name], *rig, "--out", str(out)], check=False)
    page = out / f"{name}.html"
    subprocess.run([*TCRCTL, "report", str(out / "latest"), "-o", str(page)], check=True)
    return page


@contextmanager
def emulator(rig: Path) -> Iterator[None]:
    """Let the emulated bench run in the ``with`` body; its rig file is made."""
    text = find_rig("loopback").read_text(encoding="utf-8")
    rig.write_text(re.sub(r"^safety:.*$", PATIENT, text, flags=re.MULTILINE), encoding="utf-8")
    bench = subprocess.Popen([*TCRCTL, "emulate", str(rig)], stderr=subprocess.PIPE, text=True)
    try:
        for line in bench.stderr or ():
            if "is emulated" in line:
                break
        yield
    finally:
        bench.terminate()
        bench.wait()


def photograph(page: Path, width: int, size: tuple[int, int], picture: Path) -> None:
    """Show a page in a browser and keep what is seen, in few colours."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        sys.exit("needs Chromium: apt-get install chromium")
    narrow = page.with_name(f"{width}.html")
    body = f"<body style='width:{width}px;margin:0'" if width < size[0] else "<body"
    narrow.write_text(page.read_text(encoding="utf-8").replace("<body", body, 1), encoding="utf-8")
    raw = page.with_suffix(".png")
    quiet = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-dev-shm-usage"]
    look = ["--virtual-time-budget=3000", f"--window-size={size[0]},{size[1]}", "--hide-scrollbars"]
    own = f"--user-data-dir={page.parent / 'chromium'}"
    shot = [browser, *quiet, *look, own, f"--screenshot={raw}", narrow.as_uri()]
    subprocess.run(shot, check=True, capture_output=True, timeout=120)
    with Image.open(raw) as image:
        seen = image.convert("RGB").crop((0, 0, width, image.height))
    seen.quantize(COLOURS, dither=Image.Dither.NONE).save(picture, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
