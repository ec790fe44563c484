"""The report: one page that needs nothing else, says what is simulated, and shows what it was given."""

import re
from html.parser import HTMLParser

import matplotlib
import numpy as np
import pandas as pd
import pytest
from mimique.errors import InputError
from mimique.synthesis.affect_colours import AFFECT_COLOURS
from mimique.workbench.reports import corpus_figures as report_figures
from mimique.workbench.reports.corpus_report import ReportData, SegmentationExample, build_report
from mimique.workbench.reports.tables import format_value, make_table
from scipy import stats

TIMES = pd.DataFrame(
    [[12.7, 22.7, 0.3, 63.5], [16.4, 23.2, np.nan, 37.2]],
    index=["cr_IE", "cr_SE"],
    columns=["neutral", "anger", "gap", "transitions"],
)
NASTY = "<script>alert('x')</script> & $a_1$ \"q\""


def make_evaluation() -> pd.DataFrame:
    rows = [
        (signer, classifier, segmentation, 40, accuracy, accuracy + 0.1, 0.3)
        for signer in ("cr", "cl")
        for classifier, accuracy in (("1-NN", 0.5), ("random forest", 0.75))
        for segmentation in ("manual", "automatic")
    ]
    columns = ["signer", "classifier", "segmentation", "n_segments", "accuracy", "accuracy_duration", "majority"]
    return pd.DataFrame(rows, columns=columns)


def make_data(**changes) -> ReportData:
    tier = pd.DataFrame({"onset": [0, 60, 80], "offset": [60, 80, 200], "label": ["neutral", "NJ", "joy"]})
    given = {
        "corpus": "demo",
        "snapshot": "VFKX1S2N",
        "version": "0.1.0",
        "created": "2026-11-22 16:20 UTC",
        "simulated": True,
        "takes": pd.DataFrame(
            {
                "take": ["cr_IE_1", "cr_SE_1"],
                "signer": ["cr", "cr"],
                "protocol": ["IE", "SE"],
                "seconds": [99.2, 76.8],
                "n_markers": [46, 46],
            }
        ),
        "recording_times": TIMES,
        "residuals": pd.DataFrame({"take": ["cr_IE_1", "cr_SE_1"], "mean": [0.5, 0.7], "p95": [1.1, 1.9]}),
        "example": SegmentationExample(
            "cr_IE_1",
            100.0,
            {"E_vel": np.linspace(0, 1, 200), "τ E_acc": np.ones(200)},
            {"manual": tier, "automatic": tier},
        ),
        "evaluation": make_evaluation(),
        "confusions": {
            "cr, random forest": pd.DataFrame([[3, 1], [0, 4]], index=["joy", "fear"], columns=["joy", "fear"])
        },
        "quality_notes": ["Marker A is missing for 0.4 s."],
        "history": pd.DataFrame({"snapshot": ["VFKX1S2N"], "message": ["Ingest"]}),
        "parameters": {"alpha": 0.3},
        "portrait": b"\x89PNG\r\n",
    }
    return ReportData(**(given | changes))


class Page(HTMLParser):
    """What a page consists of, and whether its elements are closed in order."""

    VOID = frozenset({"meta", "img", "br", "hr", "link", "input"})

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict]] = []
        self.text: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()

    def handle_data(self, data):
        if not {"style", "svg"} & set(self.open):
            self.text.append(data)
            if {"td", "th"} & set(self.open):
                self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def html():
    return build_report(make_data())


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


def test_the_page_is_whole_and_loads_nothing(html, page):
    assert page.open == []
    for tag, attributes in page.tags:
        assert tag not in ("script", "link", "iframe", "object"), tag
        for name in ("src", "href", "xlink:href"):
            assert attributes.get(name, "#").startswith(("#", "data:")), (tag, attributes)
    style = html[html.index("<style>") : html.index("</style>")]
    assert "@import" not in style and "url(" not in style
    assert sum(tag == "svg" for tag, _ in page.tags) == 4


def test_contents_lead_to_sections(page):
    targets = [a["href"][1:] for tag, a in page.tags if tag == "a"]
    assert targets == [a["id"] for tag, a in page.tags if tag == "section"]
    assert targets == ["takes", "quality", "times", "residuals", "segmentation", "evaluation", "provenance"]


def test_ids_of_different_figures_do_not_clash(html):
    figures = re.findall(r"<svg.*?</svg>", html, flags=re.S)
    definitions = [set(re.findall(r'<(?:clipPath|path) id="([^"]+)"', figure)) for figure in figures]
    drawn = [set(re.findall(r"#([^\")]+)[\")]", figure)) for figure in figures]
    for i, used in enumerate(drawn):
        others = set().union(*(d for j, d in enumerate(definitions) if j != i))
        assert not (used & others) - definitions[i]


def test_everything_computed_from_simulated_data_says_so(html, page):
    headings = re.findall(r"<h2>(.*?)</h2>", html)
    assert [("simulated" in h) for h in headings] == [True] * 6 + [False]  # provenance is not computed from the data
    captions = re.findall(r"<(?:figcaption|caption|summary)>(.*?)</(?:figcaption|caption|summary)>", html)
    history = [c for c in captions if c == "Snapshots"]
    assert len(history) == 1
    assert all("Simulated data" in c for c in captions if c not in history) and len(captions) >= 8
    assert "simulated" not in build_report(make_data(simulated=False)).lower()


def test_table_b1_has_both_totals(page):
    rows = {row[0]: row[1:] for row in page.rows}
    assert rows["cr_IE"] == ["12.7", "22.7", "0.3", "63.5", "99.2"]
    assert rows["cr_SE"] == ["16.4", "23.2", "0.0", "37.2", "76.8"]
    assert rows["all"] == ["29.1", "45.9", "0.3", "100.7", "176.0"]


def test_scores_are_in_the_table_as_given(page):
    assert ["cr", "random forest", "manual", "40", "75.0 %", "85.0 %", "30.0 %"] in page.rows


def test_confusions_are_shaded_by_their_share_of_the_row(html):
    assert '<td style="--share: 0.750">3</td><td style="--share: 0.250">1</td>' in html
    assert '<td style="--share: 0.000">0</td><td style="--share: 1.000">4</td>' in html


@pytest.mark.parametrize(
    ("changes", "says", "anchor"),
    [
        ({"evaluation": None}, "no classifier has been tested", "evaluation"),
        ({"residuals": pd.DataFrame({"take": [], "mean": [], "p95": []})}, "no take has been solved", "residuals"),
        ({"example": None}, "no take has been segmented", "segmentation"),
        ({"recording_times": None}, "no take has been annotated", "times"),
        ({"quality_notes": ()}, "nothing was checked", "quality"),
    ],
)
def test_what_is_absent_is_left_out_and_said(changes, says, anchor):
    html = build_report(make_data(**changes))
    assert html.count("Not in this report:") == 1 and says in html
    assert f'id="{anchor}"' not in html and f'href="#{anchor}"' not in html


def test_an_empty_corpus_still_has_a_report():
    page = Page(build_report(ReportData("empty", "X", "0.1.0", "now")))
    assert page.open == [] and [a["id"] for tag, a in page.tags if tag == "section"] == ["provenance"]


def test_all_text_from_outside_is_escaped():
    tier = pd.DataFrame({"onset": [0], "offset": [50], "label": [NASTY]})
    data = make_data(
        corpus=NASTY,
        snapshot=NASTY,
        version=NASTY,
        created=NASTY,
        takes=pd.DataFrame({NASTY: [NASTY], "signer": [NASTY], "protocol": [NASTY], "seconds": [1.0]}),
        recording_times=TIMES.rename(index={"cr_IE": NASTY}, columns={"gap": NASTY}),
        residuals=pd.DataFrame({"take": [NASTY], "mean": [1.0], "p95": [2.0]}),
        example=SegmentationExample(NASTY, 10.0, {NASTY: np.ones(50)}, {NASTY: tier}, unit=NASTY),
        evaluation=make_evaluation().replace({"cr": NASTY, "1-NN": NASTY, "manual": NASTY}),
        confusions={NASTY: pd.DataFrame([[1]], index=[NASTY], columns=[NASTY])},
        quality_notes=[NASTY],
        history=pd.DataFrame({NASTY: [NASTY]}),
        parameters={NASTY: NASTY},
    )
    html = build_report(data)
    assert "<script" not in html
    page = Page(html)
    assert page.open == []
    assert "".join(page.text).count(NASTY) > 20


def test_figures_take_their_ink_from_the_page_and_leave_matplotlib_alone():
    before = dict(matplotlib.rcParams)
    svg = report_figures.draw_evaluation(make_evaluation())
    assert dict(matplotlib.rcParams) == before
    assert "var(--ink)" in svg and "var(--quiet)" in svg
    assert "#000000" not in svg and "fill: black" not in svg
    assert svg == report_figures.draw_evaluation(make_evaluation())  # and are the same every time


def test_bars_stand_for_seconds():
    svg = report_figures.draw_recording_times(TIMES)
    widths = {}
    for name, colour in (("neutral", AFFECT_COLOURS["neutral"]), ("anger", AFFECT_COLOURS["anger"])):
        paths = re.findall(r'<path d="M ([\d.]+) [\d.]+ ?\nL ([\d.]+) [^"]*"[^>]*fill: ' + colour, svg)
        widths[name] = sorted(abs(float(a) - float(b)) for a, b in paths)[-2:]
    assert widths["anger"][1] / widths["neutral"][1] == pytest.approx(23.2 / 16.4, rel=1e-3)
    assert widths["anger"][0] / widths["neutral"][0] == pytest.approx(22.7 / 12.7, rel=1e-3)


def test_wilson_interval_is_that_of_scipy():
    for k, n in ((0, 5), (3, 7), (40, 40), (113, 231)):
        low, high = report_figures.wilson_interval(k / n, n)
        expected = stats.binomtest(k, n).proportion_ci(0.95, method="wilson")
        assert (float(low), float(high)) == pytest.approx((expected.low, expected.high), abs=1e-6)


def test_wilson_interval_of_nothing_is_nothing():
    assert np.isnan(report_figures.wilson_interval(np.nan, 0)).all()
    with pytest.raises(InputError, match="accuracy"):
        report_figures.wilson_interval([0.5, 75.0], [10, 10])


@pytest.mark.parametrize(
    ("value", "column", "text"),
    [
        (0.4375, "accuracy", "43.8 %"),
        (np.nan, "mean", "–"),
        (None, "", "–"),
        (np.int64(200), "rate", "200"),
        (200.0, "rate", "200"),
        (0.12345, "mean", "0.123"),
        (61.0, "seconds", "61.0"),
        (True, "", "yes"),
    ],
)
def test_values_have_sensible_digits(value, column, text):
    assert format_value(value, column) == text


def test_many_takes_are_folded_and_drawn_as_dots():
    many = pd.DataFrame({"take": [f"t{i}" for i in range(60)], "mean": np.arange(60) + 1.0, "p95": np.arange(60) + 2.0})
    html = build_report(make_data(residuals=many))
    assert "Residuals of all takes (60 rows)</summary>" in html


def test_tables_that_lack_columns_are_refused():
    with pytest.raises(InputError, match=r"evaluation.*accuracy"):
        make_data(evaluation=pd.DataFrame({"signer": ["cr"]}))
    with pytest.raises(InputError, match="residuals"):
        make_data(residuals=pd.DataFrame({"take": ["a"]}))
    with pytest.raises(InputError, match="energies of one length"):
        SegmentationExample("t", 10.0, {"a": np.ones(3), "b": np.ones(4)}, {})


def test_intervals_stand_behind_their_numbers_and_people_beside_the_classifiers():
    table = pd.DataFrame(
        {"rater": ["A2"], "accuracy": [0.9], "accuracy_low": [0.8], "accuracy_high": [0.95], "kappa": [0.5]}
    )
    rows = make_table(table)
    assert "90.0 % [80.0, 95.0]" in rows and "accuracy low" not in rows
    gap = make_table(table.assign(accuracy_low=np.nan))
    assert "90.0 %</td>" in gap
    scores = make_data().evaluation
    people = pd.DataFrame(
        {
            "signer": [scores["signer"].iloc[0]], "segmentation": [scores["segmentation"].iloc[0]],
            "kind": ["person"], "reading": ["from scratch"], "accuracy": [0.875],
        }
    )  # fmt: skip
    assert "second annotator" in report_figures.draw_evaluation(scores, people)
    assert "second annotator" not in report_figures.draw_evaluation(scores, people.assign(reading="with proposals"))
    assert "People and machines on the same segments" in build_report(make_data(people=people))
