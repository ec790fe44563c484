"""ELAN documents from and to the page."""

import json
import re
import shutil
import uuid
from urllib.parse import unquote

import pandas as pd
import pytest
from mimique.corpus import Corpus, read_tiers, write_tiers
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts.records import make_key
from mimique.workbench.review.elan import routes
from mimique.workbench.review.elan.exporting import disposition
from mimique.workbench.review.elan.told_warnings import told_warnings

from .review_corpus import LABELS, MODEL, RATE, make_review_corpus
from .showing_app import make_client

TAKE = "ab_IE_1"
PERSON = "Ann É"
BOMB = b"""<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "aaaaaaaaaa">
<!ENTITY c "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY d "&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;">]>
<ANNOTATION_DOCUMENT>&d;</ANNOTATION_DOCUMENT>"""
OUTSIDE = b"""<!DOCTYPE b [<!ENTITY f SYSTEM "file:///etc/passwd">]><ANNOTATION_DOCUMENT>&f;</ANNOTATION_DOCUMENT>"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("elan") / "corpus"
    make_review_corpus(folder, takes=(TAKE,), n_frames=900)
    return folder


@pytest.fixture
def place(tmp_path, made):
    shutil.copytree(made, tmp_path / "corpus")
    return tmp_path


@pytest.fixture
def review(place):
    review = open_review(place / "corpus", owner=PERSON)
    yield review
    review.close()


@pytest.fixture
def client(review):
    return make_client(review, routes.router, person=PERSON, is_lead=True)


def export(client, **parameters):
    answer = client.get("/api/elan", params={"take": TAKE, **parameters})
    assert answer.status_code == 200, answer.text
    return answer


def send(client, data, tiers, version, request=None, take=TAKE):
    parameters = {"take": take, "version": version, "request": request or str(uuid.uuid4()), "tiers": json.dumps(tiers)}
    headers = {"Content-Type": "application/octet-stream"}
    return client.post("/api/elan/import", params=parameters, content=data, headers=headers)


def preview(client, data, take=TAKE):
    return client.post("/api/elan/preview", params={"take": take}, content=data)


def rows_of(review, tier="affect", person=PERSON, take=TAKE):
    return list(review.drafts.open(make_key(person, take)).tiers[tier].rows)


def version_of(review, person=PERSON):
    return review.drafts.open(make_key(person, TAKE)).version


def make_eaf(tmp_path, table, name="affect", **facts):
    table.attrs.update(facts)
    write_tiers(tmp_path / "made.eaf", {name: table}, RATE)
    return (tmp_path / "made.eaf").read_bytes()


def draw_blind(review, *people, done=()):
    with review.database.write() as connection:
        for person in people:
            connection.execute(
                "INSERT INTO coding (take, person, tier, done) VALUES (?, ?, 'affect', ?)",
                (TAKE, person, int(person in done)),
            )


def test_what_is_exported_is_what_the_draft_holds(client, review, tmp_path):
    first, second = rows_of(review)[:2]
    key = make_key(PERSON, TAKE)
    review.drafts.edit(
        key, {"kind": "accept", "tier": "affect", "segments": [first["id"]]}, request="a", version=version_of(review)
    )
    move = {"kind": "move", "tier": "affect", "segment": second["id"], "offset": second["offset"] + 3}
    review.drafts.edit(key, move, request="b", version=version_of(review))
    answer = export(client)
    (tmp_path / "got.eaf").write_bytes(answer.content)
    tiers = read_tiers(tmp_path / "got.eaf", RATE)
    assert set(tiers) == {"affect", f"affect@{MODEL}"}
    expected = pd.DataFrame(rows_of(review))
    for column in ("id", "onset", "offset", "label", "status", "origin", "revision", "confidence"):
        found = tiers["affect"][column]
        assert (
            found.tolist() == pytest.approx(expected[column].tolist(), nan_ok=True)
            if column == "confidence"
            else (found.tolist() == expected[column].tolist())
        ), column
    assert tiers["affect"].attrs["author"] == PERSON
    machine = review.corpus().tier(TAKE, "affect", MODEL)
    assert tiers[f"affect@{MODEL}"][["onset", "offset", "label"]].equals(machine[["onset", "offset", "label"]])
    assert "x-mimique-warnings" not in answer.headers
    assert answer.headers["content-type"] == "application/xml"


def test_the_same_file_back_changes_nothing(client, review):
    data = export(client).content
    before = rows_of(review)
    shown = preview(client, data).json()
    assert {tier["name"]: tier["tier"] for tier in shown["tiers"]} == {"affect": "affect", f"affect@{MODEL}": None}
    assert all(tier["problems"] == [] for tier in shown["tiers"]) and shown["warnings"] == []
    assert shown["tiers"][0]["segments"] == len(before)
    answer = send(client, data, {"affect": "affect"}, version_of(review))
    assert answer.status_code == 200 and answer.json()["changes"] == [] and rows_of(review) == before


def test_what_was_changed_in_elan_becomes_one_edit(client, review):
    before = rows_of(review)
    chosen = before[2]
    # As ELAN would: another value for one annotation.
    text = export(client).content.decode()
    part = re.search(rf'ANNOTATION_ID="a0*{chosen["id"]}".*?</ANNOTATION_VALUE>', text, re.DOTALL)[0]
    other = next(label for label in LABELS if label != chosen["label"])
    changed = text.replace(part, re.sub(r"<ANNOTATION_VALUE>.*?<", f"<ANNOTATION_VALUE>{other}<", part), 1).encode()
    start = version_of(review)
    answer = send(client, changed, {"affect": "affect", f"affect@{MODEL}": None}, start)
    assert answer.status_code == 200, answer.text
    edit = answer.json()
    assert edit["version"] == start + 1 and edit["undo"] == "import" and edit["unpublished"] == 1
    (change,) = edit["changes"]
    assert change["removed"] == [str(chosen["id"])] and [one["id"] for one in change["added"]] == [str(chosen["id"])]
    after = rows_of(review)
    assert [row for row in after if row["id"] != chosen["id"]] == [row for row in before if row["id"] != chosen["id"]]
    row = after[2]
    assert (row["label"], row["status"], row["origin"]) == (other, "reviewed", "human")
    assert row["revision"] == chosen["revision"] + 1 and row.get("confidence") is None
    review.drafts.undo(make_key(PERSON, TAKE), request="u", version=edit["version"])
    assert rows_of(review) == before


def test_sent_twice_it_counts_once_and_a_stale_one_is_refused(client, review, tmp_path):
    data = make_eaf(tmp_path, pd.DataFrame({"onset": [0, 50], "offset": [50, 90], "label": ["J", "N"]}))
    start, request = version_of(review), str(uuid.uuid4())
    first = send(client, data, {"affect": "affect"}, start, request)
    again = send(client, data, {"affect": "affect"}, start, request)
    assert first.status_code == again.status_code == 200 and first.json() == again.json()
    assert version_of(review) == start + 1
    stale = send(client, data, {"affect": "affect"}, start)
    assert stale.status_code == 409 and stale.json()["error"]["kind"] == "stale"


def test_several_tiers_are_one_edit(client, review, tmp_path):
    corpus = Corpus.open(review.location)
    with corpus.transaction("Add a vocabulary") as edit:
        edit.put_vocabulary("intensity", ["1", "2"])
    table = pd.DataFrame({"onset": [0], "offset": [50], "label": ["J"]})
    other = pd.DataFrame({"onset": [0], "offset": [50], "label": ["2"]})
    write_tiers(tmp_path / "two.eaf", {"Affect": table, "force": other}, RATE)
    data = (tmp_path / "two.eaf").read_bytes()
    assert [tier["tier"] for tier in preview(client, data).json()["tiers"]] == ["affect", None]
    answer = send(client, data, {"Affect": "affect", "force": "intensity"}, version_of(review))
    assert {change["tier"] for change in answer.json()["changes"]} == {"affect", "intensity"}
    assert [row["label"] for row in rows_of(review, "intensity")] == ["2"]
    review.drafts.undo(make_key(PERSON, TAKE), request="u", version=answer.json()["version"])
    assert rows_of(review, "intensity") == [] and len(rows_of(review)) > 1


@pytest.mark.parametrize("mode", ["blind", "none"])
def test_a_blind_take_gives_nothing_of_others_away(review, client, mode):
    secret = pd.DataFrame({"onset": [10], "offset": [700], "label": ["SECRET"]})
    write_tiers(review.folder / "doc.eaf", {"gloss": secret}, RATE)
    with Corpus.open(review.location).transaction("Add others'") as edit:
        edit.put_document(TAKE, f"{TAKE}.eaf", (review.folder / "doc.eaf").read_bytes())
        edit.put_tier(TAKE, "affect", secret, author="other")
    open_answer = export(client)
    assert open_answer.content.count(b"SECRET") >= 2  # the tier, and the document that was ingested
    draw_blind(review, "cd", "ef", *([PERSON] if mode == "blind" else []))
    answer = client.get("/api/elan", params={"take": TAKE})
    assert b"SECRET" not in answer.content and MODEL.encode() not in answer.content
    assert answer.status_code == (200 if mode == "blind" else 403)
    if mode == "blind":
        assert b'TIER_ID="affect"' in answer.content and b"ALIGNABLE_ANNOTATION" not in answer.content
        shown = preview(client, open_answer.content).json()
        assert shown["tiers"]  # what the person has already may be brought


def test_an_adjudication_is_for_leads(review):
    nobody = make_client(review, routes.router, person="cd")
    answer = nobody.get("/api/elan", params={"take": TAKE, "purpose": "adjudication"})
    assert answer.status_code == 403 and answer.json()["error"]["kind"] == "forbidden"


def test_a_take_that_is_gone_can_still_be_exported(client, review):
    before = rows_of(review)
    accept = {"kind": "accept", "tier": "affect", "segments": [before[0]["id"]]}
    review.drafts.edit(make_key(PERSON, TAKE), accept, request="a", version=version_of(review))
    with Corpus.open(review.location).transaction("Delete") as edit:
        edit.delete_take(TAKE)
    assert export(client).content.count(b"<ALIGNABLE_ANNOTATION") == 2 * len(before)
    assert preview(client, b"<x/>").status_code == 404


def test_no_consent_no_file(client, review):
    with Corpus.open(review.location).transaction("Withdraw") as edit:
        edit.put_signer("ab", {"consent": "none"})
    for answer in (client.get("/api/elan", params={"take": TAKE}), preview(client, b""), send(client, b"", {}, 0)):
        assert answer.status_code == 403 and "consent" in answer.json()["error"]["message"]


def test_what_does_not_fit_is_said_before(client, review, tmp_path):
    table = pd.DataFrame({"onset": [0, 850, 2000], "offset": [50, 950, 2100], "label": ["J", "odd", "N"]})
    data = make_eaf(tmp_path, table)
    (tier,) = preview(client, data).json()["tiers"]
    assert (tier["tier"], tier["segments"]) == ("affect", 2)
    said = " | ".join(tier["problems"])
    assert "1 annotations lie after the end" in said and "1 annotations end after the take" in said
    assert "1 labels are not in the scheme: odd" in said
    answer = send(client, data, {"affect": "affect"}, version_of(review))
    assert answer.status_code == 200
    assert [(row["onset"], row["offset"], row["label"]) for row in rows_of(review)] == [(0, 50, "J"), (850, 900, "odd")]


def test_overlapping_annotations_are_refused(client, review, tmp_path):
    table = pd.DataFrame({"onset": [0, 30], "offset": [50, 80], "label": ["J", "N"]})
    with pytest.warns(UserWarning, match="begin before an earlier one ends"):
        data = make_eaf(tmp_path, table)
    (tier,) = preview(client, data).json()["tiers"]
    assert tier["tier"] is None and "overlap" in tier["problems"][0] and "J [0, 50)" in tier["problems"][0]
    before = rows_of(review)
    answer = send(client, data, {"affect": "affect"}, version_of(review))
    assert answer.status_code == 422 and "overlap" in answer.json()["error"]["message"] and rows_of(review) == before


def test_of_several_tiers_the_persons_own_is_proposed(client, review, tmp_path):
    tables = {name: pd.DataFrame({"onset": [0], "offset": [9], "label": ["J"]}) for name in ("AFFECT", "affect@x", "b")}
    tables["affect@x"].attrs["author"] = PERSON
    write_tiers(tmp_path / "several.eaf", tables, RATE)
    found = preview(client, (tmp_path / "several.eaf").read_bytes()).json()["tiers"]
    assert {tier["name"]: tier["tier"] for tier in found} == {"AFFECT": "affect", "affect@x": None, "b": None}


def test_an_empty_tier_is_not_proposed(client, review, tmp_path):
    data = make_eaf(tmp_path, pd.DataFrame({"onset": [5], "offset": [9], "label": ["J"]}))
    text = re.sub(rb"<ANNOTATION>.*</ANNOTATION>", b"", data, flags=re.DOTALL)
    (tier,) = preview(client, text).json()["tiers"]
    assert tier["tier"] is None and "empties the tier 'affect'" in tier["problems"][0]
    assert send(client, text, {"affect": "affect"}, version_of(review)).status_code == 200  # whoever wants that
    assert rows_of(review) == []


@pytest.mark.parametrize(
    "data",
    [
        b"", b"no xml", BOMB, OUTSIDE, b"\0" * 100, b"<a>" * 100_000, b"\xff\xfe<\0", b"PK\x03\x04", b"<html/>",
        b'<?xml version="1.0" encoding="utf-99"?><ANNOTATION_DOCUMENT/>',
        b"<ANNOTATION_DOCUMENT>" + b'<TIER TIER_ID="x"/>' * 300_000 + b"</ANNOTATION_DOCUMENT>",
        b"<ANNOTATION_DOCUMENT><TIME_ORDER>" + b"<TIME_ORDER>" * 50_000,
    ],
)  # fmt: skip
def test_what_is_no_elan_file_is_one_line(client, review, data):
    for answer in (preview(client, data), send(client, data, {"a": "affect"}, 0)):
        assert answer.status_code == 422, answer.text
        message = answer.json()["error"]["message"]
        assert "\n" not in message and len(message) < 900 and "root:" not in message


@pytest.mark.parametrize("value", ["", "x", "-1", "99999999999999999999999999", "1e9", "NaN"])
def test_odd_time_slots_break_nothing(client, tmp_path, value):
    data = make_eaf(tmp_path, pd.DataFrame({"onset": [5], "offset": [9], "label": ["J"]}))
    odd = re.sub(rb'TIME_VALUE="\d+"', f'TIME_VALUE="{value}"'.encode(), data)
    for answer in (preview(client, odd), send(client, odd, {"affect": "affect"}, 0)):
        assert answer.status_code in (200, 422), answer.text


def test_too_large_a_file_is_not_read(client, review, monkeypatch):
    monkeypatch.setattr(routes, "LARGEST_UPLOAD", 1000)
    answer = preview(client, b"x" * 1001)
    assert answer.status_code == 413 and answer.json()["error"]["kind"] == "too-large"
    assert preview(client, b"x" * 1000).status_code == 422


@pytest.mark.parametrize(
    "tiers", ["", "no json", "[]", "1", "{}", '{"affect": null}', '{"affect": 1}', '{"affect": "nowhere"}',
              '{"nowhere": "affect"}', '{"affect": "affect", "b": "affect"}', "[" * 10_000]
)  # fmt: skip
def test_an_odd_choice_is_refused(client, review, tmp_path, tiers):
    data = make_eaf(tmp_path, pd.DataFrame({"onset": [5], "offset": [9], "label": ["J"]}))
    parameters = {"take": TAKE, "version": version_of(review), "request": "r", "tiers": tiers}
    answer = client.post("/api/elan/import", params=parameters, content=data)
    assert answer.status_code == 422 and answer.json()["error"]["kind"] == "input", answer.text


@pytest.mark.parametrize("take", ["", "/", "..", "%", "a\nb", "\0", "😀", "x" * 10_000])
def test_odd_names_are_not_found(client, take):
    for answer in (
        client.get("/api/elan", params={"take": take}), preview(client, b"", take), send(client, b"", {}, 0, take=take),
    ):  # fmt: skip
        assert answer.status_code in (404, 422), answer.text


@pytest.mark.parametrize(
    ("take", "name"),
    [("one", "one-É.eaf"), ('a"b/../c\n%;', "a_b_.._c_%;-É.eaf"), ("😀", "😀-É.eaf"), ("\\\0", "_-É.eaf")],
)
def test_the_file_is_named_after_the_take(take, name):
    header = disposition(take, "É")
    assert header.isascii() and header.isprintable()
    plain = re.search(r'filename="([A-Za-z0-9_.-]+)";', header)
    assert plain and unquote(header.partition("filename*=UTF-8''")[2]) == name


def test_real_documents_are_understood(client, shared_data):
    files = sorted((shared_data / "annotations").rglob("*.eaf"))
    assert files
    for file in files:
        answer = preview(client, file.read_bytes())
        assert answer.status_code == 200 and answer.json()["tiers"], file
        assert all(tier["tier"] is None for tier in answer.json()["tiers"])


def test_warnings_are_lines_without_repetition():
    import warnings

    with told_warnings() as lines:
        for number in range(30):
            warnings.warn(f"line {number}\nof two", stacklevel=1)
            warnings.warn("the same", stacklevel=1)
    assert lines[0] == "line 0 of two" and lines[1] == "the same" and len(lines) == 21
    assert lines[-1] == "and 11 more like these"
