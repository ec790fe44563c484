"""Ways of working at the review page: by mouse alone, with keys of one's own, in French, with ELAN, against others."""

import pandas as pd
from mimique.corpus import Corpus, read_tiers, write_tiers

from .page_driver import PAGE_TAKES, ReviewPage, new_context, plain
from .review_corpus import MODEL, RATE, make_review_corpus
from .running_server import RunningServer

HELD = ("N", "A", "D", "F", "J", "Sa", "Su")
ODD_TAKES = (
    "<img src=x onerror=window.ran=1>",
    "\"quoted\" 'take' & more",
    "two\nlines",
    "..%2F..%2Fetc",
    "😀 caféً مرحبا \u202egnp.exe",
)
ODD_LABELS = (
    "<script>window.ran=2</script>",
    '" onclick="window.ran=3',
    "a\u202eb",
    "😀😀",
    "{count} ${1+1}",
    "l" * 200,
)


def held(review, *, but=""):
    return [one for one in review.segments() if one["label"] in HELD and one["label"] != but]


def click_segment(review, segment):
    """Click in the middle of a segment in the timeline."""
    first, last = review.ask("[s.range.value.first, s.range.value.last]")
    area = review.page.locator(".timeline-area").bounding_box()
    row = review.page.locator(".timeline-gutter [role=radio][aria-checked=true]").bounding_box()
    middle = (segment["onset"] + segment["offset"]) / 2
    x = area["x"] + (middle - first) * area["width"] / (last - first)
    review.page.mouse.click(x, row["y"] + row["height"] / 2)
    review.until("s.selection.value[0]", segment["id"])


def test_the_mouse_alone_can_do_it_all(review):
    first, second, third = held(review, but="Sa")[:3]
    start = plain(review.segments())
    click_segment(review, first)
    assert review.page.locator(f"[data-chosen='{first['id']}']").inner_text() == first["label"]
    review.command("edit.accept-stay")
    assert review.find(first["id"])["status"] == "reviewed"
    assert review.chosen()["id"] == first["id"]
    review.says("reviewed")

    click_segment(review, second)
    review.page.locator("[data-label='Sa']").click()
    review.until("s.chosen.value.label", "Sa")
    review.saved()
    assert (review.find(second["id"])["label"], review.find(second["id"])["origin"]) == ("Sa", "human")

    count = len(review.segments())
    click_segment(review, third)  # and so the playhead is on it
    middle = (third["onset"] + third["offset"]) // 2
    if not third["onset"] < review.ask("clock.frame.value") < third["offset"]:
        review.seek(middle)
    review.command("edit.split")
    assert len(review.segments()) == count + 1
    review.command("edit.merge-previous")
    assert len(review.segments()) == count
    kept = review.chosen()
    assert (kept["onset"], kept["offset"], kept["label"]) == (third["onset"], third["offset"], third["label"])
    review.command("edit.delete")
    assert len(review.segments()) == count - 1
    assert not [one for one in review.segments() if (one["onset"], one["offset"]) == (third["onset"], third["offset"])]

    done = plain(review.segments())
    steps = 0
    while review.page.locator("header").get_by_role("button", name="Undo").is_enabled():
        review.page.locator("header").get_by_role("button", name="Undo").click()
        review.page.wait_for_timeout(60)
        review.saved()
        steps += 1
    assert steps == 5
    assert plain(review.segments()) == start
    for _ in range(steps):
        review.page.locator("header").get_by_role("button", name="Redo").click()
        review.page.wait_for_timeout(60)
        review.saved()
    assert plain(review.segments()) == done
    assert review.page.locator("header").get_by_role("button", name="Redo").is_disabled()


def test_a_key_of_ones_own_survives_a_reload(review):
    review.menu("Keyboard")
    dialog = review.page.get_by_role("dialog")
    dialog.get_by_role("button", name="Add a key for “Split at the playhead”").click()
    review.page.keyboard.press("u")
    dialog.get_by_role("button", name="Take U off “Split at the playhead”").wait_for()
    dialog.get_by_role("button", name="Take S off “Split at the playhead”").click()
    dialog.get_by_role("button", name="Take S off “Split at the playhead”").wait_for(state="detached")
    review.until("s.session.value.settings.keys['edit.split']", ["U"])
    review.page.wait_for_timeout(700)  # quick changes of the settings go to the server together
    review.page.reload()
    review.ready()
    target = max(held(review), key=lambda one: one["offset"] - one["onset"])
    review.choose(target["id"])
    review.seek((target["onset"] + target["offset"]) // 2)
    count = len(review.segments())
    review.press("s")
    assert len(review.segments()) == count
    review.press("u")
    assert len(review.segments()) == count + 1
    assert review.page.locator("[data-command='edit.split'] .key").inner_text() == "U"
    review.press("?")
    review.click("All usual keys again", within="dialog")
    review.press("Escape")
    assert review.page.locator("[data-command='edit.split'] .key").inner_text() == "S"


def test_french_and_back(review):
    review.page.locator("header .popover").last.locator("button").first.click()
    review.click("Français")
    review.page.keyboard.press("Escape")
    review.says("Enregistré", "Publier", "Filtres")
    assert review.page.locator("html").get_attribute("lang") == "fr"
    review.page.wait_for_timeout(700)
    review.page.reload()
    review.ready()
    review.says("Enregistré", "Publier")
    for english in ("Saved", "Publish", "Queue", "Accept", "Split", "Labels", "Filters"):
        assert english not in review.text().split()
    first = held(review, but="A")[0]
    review.choose(first["id"])
    review.press("2")
    review.press("Control+s")
    review.says("dans 1 prise", "modification", "Annuler")
    assert "Relecture de" in review.page.get_by_role("dialog").locator(".dialog-foot input").input_value()
    review.press("Escape")
    review.page.locator("header .popover").last.locator("button").first.click()
    review.click("English")
    review.page.keyboard.press("Escape")
    review.says("Saved", "Publish 1", "Queue")
    assert review.page.locator("html").get_attribute("lang") == "en"


def test_elan_and_back(review, tmp_path):
    state = plain(review.segments())
    review.menu("ELAN")
    with review.page.expect_download() as download:
        review.page.get_by_role("dialog").get_by_role("link", name="Download .eaf").click()
    assert download.value.suggested_filename.endswith(".eaf")
    path = tmp_path / "out.eaf"
    download.value.save_as(path)
    tiers = read_tiers(path, RATE)
    name = next(name for name in tiers if name == "affect" or (name.startswith("affect") and MODEL not in name))
    table = tiers[name].copy()
    row = next(place for place, label in enumerate(table["label"]) if label in HELD and label != "Su")
    changed = (int(table["onset"].iloc[row]), int(table["offset"].iloc[row]))
    table.iloc[row, table.columns.get_loc("label")] = "Su"
    table = table.drop(index=table.index[-1])
    write_tiers(path, {**tiers, name: table}, RATE)
    review.page.get_by_role("dialog").locator("input[type=file]").set_input_files(str(path))
    bring = review.page.get_by_role("dialog").locator(".dialog-foot .button-primary")
    bring.wait_for()
    assert f"Import {len(table)} segments" in bring.inner_text()
    assert plain(review.segments()) == state, "looking changes nothing"
    bring.click()
    review.until("s.dialog.value", None)
    review.saved()
    review.says(f"{len(table)} segments imported. Undo takes them back.")
    assert len(review.segments()) == len(state) - 1
    assert [one["label"] for one in review.segments() if (one["onset"], one["offset"]) == changed] == ["Su"]
    review.press("Control+z")
    assert plain(review.segments()) == state
    review.menu("ELAN")
    (tmp_path / "no.eaf").write_text("<html>no</html>")
    review.page.get_by_role("dialog").locator("input[type=file]").set_input_files(str(tmp_path / "no.eaf"))
    review.page.get_by_role("dialog").locator(".message-error").wait_for()
    assert "no.eaf" in review.page.get_by_role("dialog").locator(".message-error").inner_text()
    review.press("Escape")
    assert plain(review.segments()) == state


def test_conflicts_are_settled_segment_by_segment(review, folder, person):
    mine = held(review, but="J")[:3]
    for one in mine:
        review.choose(one["id"])
        review.press("5")
    review.press("Control+s")
    review.publish()
    review.until("s.dialog.value", None)
    review.until("s.unpublished.value", 0)

    # Both change the same segments: a second corpus publishes first.
    corpus = Corpus.open(folder)
    theirs = corpus.tier(PAGE_TAKES[0], "affect", person)
    ours, other = mine[:2], mine[2]
    for one in ours:
        theirs.loc[theirs["id"] == int(one["id"]), "label"] = "Su"
    with corpus.transaction("Second thoughts", author="bob") as edit:
        edit.put_tier(PAGE_TAKES[0], "affect", theirs, author=person, provenance={"step": "edit"})
    for one in [*ours, other]:
        review.choose(one["id"])
        review.press("6")
    review.press("Control+s")
    review.says("2 conflicts", "2 to decide", "Changed by bob: “Second thoughts”")
    dialog = review.page.get_by_role("dialog")
    publish = dialog.locator(".dialog-foot .button-primary")
    assert publish.is_disabled()
    boxes = dialog.locator("fieldset")
    assert boxes.count() == 2
    boxes.nth(0).get_by_role("radio", name="Mine").check()
    review.says("1 to decide")
    assert publish.is_disabled()
    boxes.nth(1).get_by_role("radio", name="bob").check()
    review.says("all decided")
    publish.click()
    review.until("s.dialog.value", None)
    review.until("s.unpublished.value", 0)
    labels = Corpus.open(folder).tier(PAGE_TAKES[0], "affect", person).set_index("id")["label"]
    assert [labels[int(one["id"])] for one in [*ours, other]] == ["Sa", "Su", "Sa"]
    assert [review.find(one["id"])["label"] for one in [*ours, other]] == ["Sa", "Su", "Sa"]


def test_odd_names_neither_run_nor_break(browser, tmp_path):
    folder = tmp_path / "corpus"
    make_review_corpus(folder, takes=ODD_TAKES, n_frames=600, weights=False)
    corpus = Corpus.open(folder)
    with corpus.transaction("Odd <b>labels</b>", author="<i>bob</i>") as edit:
        edit.put_vocabulary("affect", {"labels": [*HELD, *ODD_LABELS], "transitions": False})
        rows = [
            {"onset": 80 * n, "offset": 80 * n + 70, "label": label, "status": "proposed", "origin": "model"}
            for n, label in enumerate(ODD_LABELS)
        ]
        for take in ODD_TAKES:
            edit.put_tier(take, "affect", pd.DataFrame(rows), author="<i>bob</i>", provenance={"step": "label"})
            edit.delete_tier(take, "affect", MODEL)
    with RunningServer(folder) as server, new_context(browser) as context:
        review = ReviewPage(context, server.address)
        review.ready()
        for take in ODD_TAKES:
            review.open_take(take)
            assert review.page.locator(".take-name").text_content() == take
            assert [one["label"] for one in review.segments()] == list(ODD_LABELS)
            first = review.segments()[0]
            review.choose(first["id"])
            assert review.page.locator(f"[data-chosen='{first['id']}']").text_content() == ODD_LABELS[0]
            for label in ODD_LABELS[1:]:
                buttons = review.page.locator("[data-label]")
                place = [buttons.nth(n).get_attribute("data-label") for n in range(buttons.count())].index(label)
                buttons.nth(place).click()
                review.until("s.chosen.value && s.chosen.value.label", label)
                review.saved()
            review.menu("ELAN")
            with review.page.expect_download() as download:
                review.page.get_by_role("dialog").get_by_role("link", name="Download .eaf").click()
            assert download.value.suggested_filename.endswith(".eaf")
            assert "/" not in download.value.suggested_filename
            download.value.save_as(tmp_path / "odd.eaf")
            assert list(read_tiers(tmp_path / "odd.eaf", RATE))
            review.press("Escape")
        for opener in ("Control+s", "k"):
            review.press(opener)
            review.page.wait_for_timeout(400)
            review.page.get_by_role("dialog").wait_for()
            review.press("Escape")
        review.press("Control+s")
        review.says(*(" ".join(take.split()) for take in ODD_TAKES[:4]))
        review.publish()
        review.until("s.dialog.value", None)
        review.until("s.unpublished.value", 0)
        assert review.page.evaluate("() => window.ran") is None
        assert review.page.locator("img[src='x']").count() == 0
        review.finished()
    corpus = Corpus.open(folder)
    for take in ODD_TAKES:
        assert corpus.tier(take, "affect", "ann")["label"].iloc[0] == ODD_LABELS[-1]
