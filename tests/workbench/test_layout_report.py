"""The report of a layout study: what it says, that it stands alone, and that it says the same twice."""

import base64
import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from mimique.errors import InputError
from mimique.synthesis.avatar import build_avatar
from mimique.synthesis.landmarks import FaceLandmarks
from mimique.workbench.layout_reports.layout_report import (
    LayoutFacts,
    build_layout_report,
    write_layout_pdf,
    write_layout_report,
)
from mimique.workbench.layout_reports.numbers import pick_reconstruction, pool_by_actor, sort_methods, summarise_curves
from mimique.workbench.layout_reports.placement_sheet import make_placement_sheet

from .layout_example import make_study
from .small_face import make_rig


@pytest.fixture(scope="module")
def avatar():
    rig = build_avatar()
    return rig, FaceLandmarks(rig)


@pytest.fixture(scope="module")
def dome():
    return make_rig()


def facts_of(rig, **more):
    return LayoutFacts("corpus <b>", "SNAPSHOT1", "0.1", "2026-11-22 12:00 UTC", rig, "dome & Co", **more)


@pytest.fixture(scope="module")
def page(dome):
    return build_layout_report(make_study(dome, (4, 6)), facts=facts_of(dome))


class _Reader(HTMLParser):
    """Collect what a page would load, and its links."""

    def __init__(self):
        super().__init__()
        self.loads, self.downloads, self.open, self.text = [], {}, [], []

    def handle_starttag(self, tag, attrs):
        some = dict(attrs)
        self.loads += [some[k] for k in ("src", "xlink:href") if k in some]
        if tag in ("script", "link", "iframe"):
            self.loads.append(tag)
        if "download" in some:
            self.downloads[some["download"]] = some["href"]

    def handle_data(self, data):
        self.text.append(data)


def read(page):
    reader = _Reader()
    reader.feed(page)
    return reader


# The numbers


def test_curves_are_the_mean_over_pairs_of_the_median_over_seeds():
    rows = [
        {"layout": f"seed {s}", "method": "k-means median", "set": "", "K": 10, "tested_on": a, "take": t, "mean_mm": v}
        for (a, t), values in {("A", "x"): (1.0, 2.0, 9.0), ("B", "x"): (3.0, 4.0, 5.0)}.items()
        for s, v in enumerate(values)
    ]
    found = summarise_curves(pd.DataFrame(rows))
    assert found["value"].tolist() == [3.0]  # (2 + 4)/2; the mean over all would be 4
    assert (found["low"].item(), found["high"].item()) == (2.0, 4.0)
    assert found[["n_pairs", "n_layouts"]].to_numpy().tolist() == [[2, 3]]


def test_one_pair_has_no_band_and_sets_stay_apart():
    rows = pd.DataFrame(
        {
            "layout": ["a", "b"],
            "method": "STAR",
            "set": ["a", "b"],
            "K": 41,
            "tested_on": "A",
            "take": "x",
            "mean_mm": [1.0, 2.0],
        }
    )
    found = summarise_curves(rows)
    assert found["value"].tolist() == [1.0, 2.0]
    assert found[["low", "high"]].isna().all(axis=None)


def test_rmse_of_an_actor_is_over_all_its_frames():
    rows = pd.DataFrame(
        {
            "layout": "k",
            "method": "MAN",
            "set": "MAN 15",
            "K": 15,
            "trained_on": "A",
            "tested_on": "A",
            "take": ["x", "y"],
            "frames": [10, 30],
            "rmse_printed": [2.0, 4.0],
        }
    )
    squares = np.repeat([2.0, 4.0], [10, 30]) ** 2
    assert pool_by_actor(rows)["value"].item() == pytest.approx(np.sqrt(squares.mean()))


def test_methods_keep_one_order_and_an_absent_reconstruction_is_replaced():
    assert sort_methods(["MAN", "mine", "greedy", "k-means median"]) == ["greedy", "k-means median", "MAN", "mine"]
    rows = pd.DataFrame({"reconstruction": ["solver", "solver"]})
    assert pick_reconstruction(rows, "sogp")[1] == "solver"


# The sheet


def test_sheet_of_the_avatar_pairs_mirrored_markers(avatar):
    rig, landmarks = avatar
    left, right, tip = (landmarks.vertex(n) for n in ("mouth_corner_left", "mouth_corner_right", "nose_tip"))
    alone = landmarks.vertex("cheek_left")
    layout = pd.DataFrame({"marker": ["a", "b", "c", "d"], "vertex": [left, tip, right, alone]})
    sheet = make_placement_sheet(rig, layout, landmarks=landmarks)
    assert sheet.markers["partner"].tolist() == ["3", "midline", "1", "–"]
    assert sheet.markers["place"].iloc[0] == "at the left mouth corner"
    assert sheet.markers["region"].tolist()[:2] == ["lips", "nose"]
    away = np.linalg.norm(rig.neutral[left] - rig.neutral[alone])
    assert sheet.markers["nearest"].iloc[3] == f"1: {away:.0f} mm"
    assert len(sheet.head) == 6 and sheet.head["number"].iloc[0] == "H1"
    assert not sheet.notes


def test_sheet_of_a_rig_without_landmarks_gives_coordinates_and_says_why(dome):
    layout = pd.DataFrame({"marker": ["a", "b"], "vertex": [178, 20]})
    sheet = make_placement_sheet(dome, layout)
    _, y, z = dome.neutral[178]
    assert f"{y:.0f} mm up, {z:.0f} mm forward" in sheet.markers["place"].iloc[0]
    assert sheet.head.empty
    assert len(sheet.notes) >= 2 and any("head markers" in note for note in sheet.notes)


def test_sheet_takes_given_head_markers_and_refuses_strange_vertices(dome):
    layout = pd.DataFrame({"marker": ["a"], "vertex": [178]})
    sheet = make_placement_sheet(dome, layout, head={"top": 3})
    assert sheet.head[["number", "marker", "vertex"]].to_numpy().tolist() == [["H1", "top", 3]]
    assert sheet.markers["nearest"].tolist() == ["–"]
    with pytest.raises(InputError, match="at least one marker"):
        make_placement_sheet(dome, layout.iloc[:0])
    with pytest.raises(InputError, match=f"0 to {dome.n_vertices - 1}"):
        make_placement_sheet(dome, layout.assign(vertex=dome.n_vertices))


# The page


def test_page_stands_alone_and_says_where_it_comes_from(page):
    reader = read(page)
    assert all(str(load).startswith(("data:", "#")) for load in reader.loads)
    assert "SNAPSHOT1" in page and "mimique 0.1" in page
    assert "<b>corpus" not in page and "corpus &lt;b&gt;" in page and "dome &amp; Co" in page
    assert "simulated" not in page.split("</style>")[1].replace("Simulated takes say", "")


def test_page_shows_every_part_and_numbers_its_figures(page):
    for title in ("Placement sheet", "Error by region", "When something goes wrong", "What the labels lose"):
        assert f"<h2>{title}" in page
    for figure in ("Figure 3.3 redrawn", "Figure 3.5 (a) redrawn", "Figure 3.7 redrawn", "Figure 3.8 redrawn"):
        assert figure in page
    assert page.count("RMSE as printed, (3.5) (mm)") >= 4
    assert page.count("RMSE ÷ √P (mm)") >= 4
    numbers = [int(n) for n in re.findall(r"<b>Figure (\d+)\.</b>", page)]
    assert numbers == list(range(1, len(numbers) + 1))


def test_tables_in_the_page_are_those_of_the_study(page, dome):
    study = make_study(dome, (4, 6))
    links = read(page).downloads
    assert {"errors.csv", "losses.csv", "layouts.csv", "placement.csv"} <= set(links)
    text = base64.b64decode(links["errors.csv"].partition("base64,")[2]).decode()
    found = pd.read_csv(io.StringIO(text), keep_default_na=False)
    np.testing.assert_allclose(found["mean_mm"], study.tables["errors"]["mean_mm"], rtol=1e-5)
    placed = pd.read_csv(io.StringIO(base64.b64decode(links["placement.csv"].partition("base64,")[2]).decode()))
    layout = study.layouts[study.layouts["layout"] == study.recommended]
    assert placed["vertex"].tolist() == layout["vertex"].tolist()


def test_highlights_are_those_of_the_recommended_layout(page, dome):
    study = make_study(dome, (4, 6))
    rows = study.tables["errors"]
    rows = rows[(rows["reconstruction"] == "solver") & ~rows["same_actor"]]
    own = rows[rows["layout"] == study.recommended].groupby(["tested_on", "take"])["mean_mm"].median().mean()
    assert f"<dd>{own:.2f} mm</dd>" in page
    size = int(study.recommended.split()[-1])
    base = rows[(rows["method"] == "k-means median") & (rows["K"] == size)]
    ratio = own / base.groupby(["tested_on", "take"])["mean_mm"].median().mean()
    assert f"<dd>{100 * ratio:.0f} %</dd>" in page


def test_same_study_makes_the_same_page(page, dome):
    assert build_layout_report(make_study(dome, (4, 6)), facts=facts_of(dome)) == page


def test_missing_tables_are_left_out_and_named(dome, tmp_path):
    study = make_study(dome, (4,))
    study.tables = {"errors": study.tables["errors"].query("reconstruction == 'solver'"), "noise": pd.DataFrame()}
    page = build_layout_report(study, facts=facts_of(dome, simulated=True))
    assert page.count("Not in this report") == 5
    assert "no take of this corpus is labelled" in page
    assert page.count('class="badge"') > 2 and "Simulated data. " in page
    study.tables = {}
    path = write_layout_report(study, tmp_path / "layout.html", facts=facts_of(dome))
    assert "Placement sheet" in path.read_text(encoding="utf-8")


def test_unknown_recommendation_is_refused(dome):
    study = replace(make_study(dome, (4,)), recommended="best 99")
    with pytest.raises(InputError, match="best 99"):
        build_layout_report(study, facts=facts_of(dome))


def test_report_of_a_whole_face_fits_on_a4(avatar, tmp_path):
    rig, landmarks = avatar
    study = make_study(rig, (10, 20))
    facts = facts_of(rig, landmarks=landmarks)
    pdf = write_layout_pdf(study, tmp_path / "layout.pdf", facts=facts).read_bytes()
    assert pdf.startswith(b"%PDF")
    boxes = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pdf)
    assert len(boxes) >= 6
    assert {(round(float(w)), round(float(h))) for w, h in boxes} == {(595, 842)}
