"""The page of a study is complete in itself, every mark leads to a run, nothing in it is HTML from a file."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib import pyplot

from support.studies import quick_study
from tcrctl.plots.study import draw_study
from tcrctl.report.strip import strip
from tcrctl.report.study import study_page
from tcrctl.study.groups import done
from tcrctl.study.outputs import findings
from tcrctl.study.plan import planned
from tcrctl.study.row import Row
from tcrctl.study.sweep import Done

EVIL = "</pre><script>alert(1)</script>"


class Links(HTMLParser):
    """Collects tags, the places that are linked, and those that there are."""

    def __init__(self):
        super().__init__()
        self.tags = set()
        self.links = []
        self.places = set()

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.tags.add(tag)
        if str(given.get("href", "")).startswith("#"):
            self.links.append(given["href"][1:])
        if "id" in given:
            self.places.add(given["id"])


@pytest.fixture
def swept(tmp_path):
    """A study whose results are made up: two cases, two values of a key, three seeds; some runs were stopped."""
    study = quick_study(
        tmp_path, description=EVIL, cases={"a": {}, EVIL: {"plant.latency_ms": 5}}, seeds="0..2",
        vary={"plant.noise_um": [10, 20]},
        measures=["position_error_mm.max"], compare={"factor": "case", "against": "a"},
    )  # fmt: skip
    runs, rows = planned(study), []
    for i, run in enumerate(runs):
        result = {"position_error_mm": {"max": 1.0 + i % 5}}
        bad = i % 4 == 3
        rows.append(
            Row(run.address, "aborted" if bad else "success", EVIL if bad else "", {} if bad else result)
        )
    return study, Done(tuple(runs), tuple(rows), 0, 1.0, 0, None)


def test_every_mark_leads_to_its_run_and_every_run_says_how_it_is_done_again(swept, tmp_path):
    study, result = swept
    page = study_page(findings(study.spec, result), result, tmp_path)
    parsed = Links()
    parsed.feed(page)
    assert sorted(parsed.links) == sorted(parsed.places)
    assert len(parsed.places) == len(result.runs) == 12
    assert page.count("tcrctl run letter_t --set") == len(result.runs)


def test_nothing_from_a_file_is_html_and_nothing_is_loaded(swept, tmp_path):
    study, result = swept
    page = study_page(findings(study.spec, result), result, tmp_path)
    parsed = Links()
    parsed.feed(page)
    assert "script" not in parsed.tags
    assert "default-src 'none'" in page
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", page)


def test_marks_keep_the_order_of_their_values_and_stopped_ones_stand_aside():
    values = [3.0, 0.5, 2.0, float("inf")]
    picture = strip({"a": [(f"r{i}", "", value) for i, value in enumerate(values)]})
    places = [float(x) for x in re.findall(r'circle cx="([\d.]+)"', picture)]
    assert np.argsort(places).tolist() == np.argsort(values).tolist()
    assert picture.count('class="stopped"') == 1


def test_a_study_is_drawn_and_the_map_shows_the_medians(swept):
    study, result = swept
    figures = dict(draw_study(study.spec, done(result.runs, result.rows)))
    assert list(figures) == [f"position_error_mm_max_{kind}" for kind in ("box", "distribution", "map")]
    texts = [text.get_text() for text in figures["position_error_mm_max_map"].axes[0].texts]
    assert len(texts) == 4  # two cases, two noises
    curves = figures["position_error_mm_max_distribution"].axes[0].lines
    shares = [curve.get_ydata()[-1] for curve in curves]
    assert all(0.0 < share <= 1.0 for share in shares)
    assert min(shares) < 1.0  # of a group with a stopped run
    pyplot.close("all")
