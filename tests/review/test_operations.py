"""Operations on a tier, against a slow one that knows nothing but which segment each single frame belongs to."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.corpus.versions.segment_rows import sort_rows
from mimique.errors import InputError
from mimique.workbench.review.drafts.operations import apply_operation, check_label
from mimique.workbench.review.drafts.replacing import replace_rows

N = 24
LABELS = ("N", "A", "J")


def segment(number, onset, offset, label="N", **more):
    return {
        "id": number,
        "onset": onset,
        "offset": offset,
        "label": label,
        "confidence": 0.5,
        "status": "proposed",
        "origin": "model",
        "revision": 0,
        "kind": "interval",
        **more,
    }


def without_confidence(row):
    return {name: value for name, value in row.items() if name != "confidence"}


def counter(start=1000):
    numbers = itertools.count(start)
    return lambda: next(numbers)


def apply(rows, operation, n_frames=N, new_id=None, **more):
    change = apply_operation(rows, operation, n_frames, new_id or counter(), **more)
    gone = {row["id"] for row in change.removed}
    assert gone <= {row["id"] for row in rows}
    result = sort_rows([*(row for row in rows if row["id"] not in gone), *change.added])
    for first, second in itertools.pairwise(result):
        assert first["offset"] <= second["onset"]
    assert all(0 <= row["onset"] < row["offset"] <= n_frames for row in result)
    assert len({row["id"] for row in result}) == len(result)
    return result


class Frames:
    """The oracle: an owner for every frame, and what is known of each owner."""

    def __init__(self, rows):
        self.owner = [None] * N
        self.facts = {}
        for row in rows:
            for frame in range(row["onset"], row["offset"]):
                self.owner[frame] = row["id"]
            self.facts[row["id"]] = [row["label"], row["status"], row["origin"], row.get("confidence")]

    def runs(self):
        found = []
        for owner, group in itertools.groupby(range(N), key=lambda frame: self.owner[frame]):
            frames = list(group)
            if owner is not None:
                found.append((frames[0], frames[-1] + 1, *self.facts[owner]))
        return found

    def order(self):
        return [owner for owner, _ in itertools.groupby(self.owner) if owner is not None]

    def span(self, name):
        frames = [frame for frame in range(N) if self.owner[frame] == name]
        return frames[0], frames[-1] + 1

    def part(self, new_id):
        """Give the later piece of an owner that lies on both sides of another a name of its own."""
        seen, before, names = set(), None, {}
        for frame, owner in enumerate(list(self.owner)):
            if owner is not None:
                if owner != before and owner in seen:
                    names[owner] = new_id()
                    self.facts[names[owner]] = list(self.facts[owner])
                seen.add(owner)
                self.owner[frame] = names.get(owner, owner)
            before = owner

    def paint(self, onset, offset, owner):
        for frame in range(onset, offset):
            self.owner[frame] = owner

    def touch(self, name):
        self.facts[name][1:3] = ["reviewed", "human"]

    def relabel(self, name, label):
        if self.facts[name][0] == label:
            self.facts[name][1] = "reviewed"
        else:
            self.facts[name] = [label, "reviewed", "human", None]

    def do(self, operation, new_id):  # noqa: C901
        """Return False where it cannot be done."""
        kind = operation["kind"]
        if kind == "accept":
            for name in operation["segments"]:
                self.facts[name][1] = "reviewed"
        elif kind == "relabel":
            for name in operation["segments"]:
                self.relabel(name, operation["label"])
        elif kind == "delete":
            self.owner = [None if owner in operation["segments"] else owner for owner in self.owner]
        elif kind == "add":
            onset, offset = operation["onset"], operation["offset"]
            if any(run[:2] == (onset, offset) for run in self.runs()):
                self.relabel(self.owner[onset], operation["label"])
                return True
            name = new_id()
            self.paint(onset, offset, name)
            self.facts[name] = [operation["label"], "reviewed", "human", None]
            self.part(new_id)
        elif kind == "split":
            onset, offset = self.span(operation["segment"])
            if not onset < operation["frame"] < offset:
                return False
            name = new_id()
            self.touch(operation["segment"])
            self.facts[name] = list(self.facts[operation["segment"]])
            self.paint(operation["frame"], offset, name)
        elif kind == "merge":
            return self.merge(operation)
        elif kind == "move":
            return self.move(operation)
        return True

    def merge(self, operation):
        order = self.order()
        places = sorted(order.index(name) for name in set(operation["segments"]))
        if len(places) < 2 or places != list(range(places[0], places[-1] + 1)):
            return False
        names = [order[place] for place in places]
        labels = {self.facts[name][0] for name in names}
        label = operation.get("label") or self.facts[names[0]][0]
        onset, offset = self.span(names[0])[0], self.span(names[-1])[1]
        confidence = self.facts[names[0]][3] if labels == {label} else None
        self.facts[names[0]] = [label, "reviewed", "human", confidence]
        self.paint(onset, offset, names[0])
        return True

    def move(self, operation):  # noqa: C901
        name = operation["segment"]
        onset, offset = self.span(name)
        new_onset, new_offset = operation.get("onset", onset), operation.get("offset", offset)
        if not 0 <= new_onset < new_offset <= N:
            return False
        if (new_onset, new_offset) == (onset, offset):
            return True
        order = self.order()
        place = order.index(name)
        left = order[place - 1] if place else None
        right = order[place + 1] if place + 1 < len(order) else None
        spans = {other: self.span(other) for other in order}
        spans[name] = (new_onset, new_offset)
        together = operation.get("together", True)
        if left is not None:
            begin, end = spans[left]
            if end > new_onset or (end == onset and together):
                spans[left] = (begin, new_onset)
        if right is not None:
            begin, end = spans[right]
            if begin < new_offset or (begin == offset and together):
                spans[right] = (new_offset, end)
        if any(begin >= end for begin, end in spans.values()):
            return False
        taken = [None] * N
        for other, (begin, end) in spans.items():
            for frame in range(begin, end):
                if taken[frame] is not None:
                    return False
                taken[frame] = other
        self.owner = taken
        self.touch(name)
        return True


@st.composite
def tiers(draw):
    cuts = sorted(draw(st.sets(st.integers(0, N), min_size=2, max_size=9)))
    rows = []
    for number, (onset, offset) in enumerate(itertools.pairwise(cuts)):
        if draw(st.integers(0, 3)):
            rows.append(segment(number + 1, onset, offset, draw(st.sampled_from(LABELS))))
    return rows


@st.composite
def operations(draw):
    kind = draw(st.sampled_from(["accept", "relabel", "delete", "add", "split", "merge", "move", "move"]))
    return (
        kind,
        draw(st.lists(st.integers(0, 50), min_size=1, max_size=3)),
        draw(st.integers(-1, N + 1)),
        draw(st.integers(-1, N + 1)),
        draw(st.sampled_from(LABELS)),
        draw(st.integers(0, 5)),
    )


def resolve(choice, rows):
    """Make an operation of drawn numbers, on segments that are there."""
    kind, picks, first, second, label, flags = choice
    ids = [row["id"] for row in sort_rows(rows)]
    if kind == "add":
        return {"kind": kind, "onset": first, "offset": second, "label": label}
    if not ids:
        return None
    names = [ids[pick % len(ids)] for pick in picks]
    if kind in ("accept", "delete"):
        return {"kind": kind, "segments": names}
    if kind == "relabel":
        return {"kind": kind, "segments": names, "label": label}
    if kind == "split":
        return {"kind": kind, "segment": names[0], "frame": first}
    if kind == "merge":
        start = picks[0] % len(ids)
        names = ids[start : start + 2 + flags % 2] if flags else names
        return {"kind": kind, "segments": names} | ({"label": label} if flags % 3 == 0 else {})
    operation = {"kind": kind, "segment": names[0], "together": flags % 2 == 0}
    if flags < 4:
        operation["onset"] = first
    if flags > 1:
        operation["offset"] = second
    return operation


@settings(max_examples=150)
@given(tiers(), st.lists(operations(), min_size=1, max_size=12))
def test_operations_do_what_frame_by_frame_bookkeeping_does(rows, choices):
    new_id, other_id = counter(1000), counter(5000)
    for choice in choices:
        operation = resolve(choice, rows)
        if operation is None:
            continue
        oracle = Frames(rows)
        inside = operation["kind"] != "add" or 0 <= operation["onset"] < operation["offset"] <= N
        if not inside or not oracle.do(operation, other_id):
            with pytest.raises(InputError):
                apply(rows, operation, new_id=new_id)
            continue
        before = {row["id"]: row for row in rows}
        rows = apply(rows, operation, new_id=new_id)
        assert [
            (r["onset"], r["offset"], r["label"], r["status"], r["origin"], r.get("confidence")) for r in rows
        ] == oracle.runs()
        # Ids survive: whoever the oracle still knows by an old name has it here, and the same frames.
        old = {name for name in oracle.order() if name in before}
        assert old == {row["id"] for row in rows} & set(before)
        for row in rows:
            if row["id"] in old:
                assert (row["onset"], row["offset"]) == oracle.span(row["id"])
                same = {k: v for k, v in row.items() if k != "revision"} == {
                    k: v for k, v in before[row["id"]].items() if k != "revision"
                }
                assert row["revision"] == before[row["id"]]["revision"] + (not same)


def test_accepting_keeps_origin_and_confidence_and_is_no_edit_twice():
    rows = [segment(1, 0, 5), segment(2, 5, 9)]
    once = apply(rows, {"kind": "accept", "segments": [1, 1]})
    assert once[0] == segment(1, 0, 5, status="reviewed", revision=1)
    assert once[1] == rows[1]
    assert not apply_operation(once, {"kind": "accept", "segments": [1]}, N, counter())


def test_a_shared_boundary_moves_for_both_and_the_neighbour_stays_proposed():
    rows = [segment(1, 0, 5), segment(2, 5, 9, "A")]
    moved = apply(rows, {"kind": "move", "segment": 2, "onset": 7})
    assert moved[0] == segment(1, 0, 7, revision=1)
    assert moved[1] == segment(2, 7, 9, "A", status="reviewed", origin="human", revision=1)
    alone = apply(rows, {"kind": "move", "segment": 2, "onset": 7, "together": False})
    assert alone[0] == rows[0]


def test_a_move_refuses_to_leave_no_frame_of_a_neighbour():
    rows = [segment(1, 0, 5), segment(2, 5, 9), segment(3, 9, 10)]
    with pytest.raises(InputError, match=r"N \[9, 10\): no frame of it would be left"):
        apply(rows, {"kind": "move", "segment": 2, "offset": 12})


def test_split_and_merge_name_their_parents():
    split = apply([segment(7, 0, 8, "A")], {"kind": "split", "segment": 7, "frame": 3}, new_id=lambda: 99)
    assert [(row["id"], row["onset"], row["offset"], row.get("parents")) for row in split] == [
        (7, 0, 3, None),
        (99, 3, 8, "7"),
    ]
    merged = apply(split, {"kind": "merge", "segments": [99, 7]})
    assert [(row["id"], row["onset"], row["offset"], row["parents"]) for row in merged] == [(7, 0, 8, "7,99")]


def test_merging_fills_the_gap_and_forgets_a_confidence_of_another_label():
    rows = [segment(1, 0, 3, "A"), segment(2, 6, 9, "J")]
    merged = apply(rows, {"kind": "merge", "segments": [1, 2], "label": "J"})
    assert merged == [
        without_confidence(segment(1, 0, 9, "J", status="reviewed", origin="human", revision=1, parents="1,2"))
    ]


def test_a_point_stays_one_frame_long():
    rows = [segment(1, 0, 4), segment(2, 4, 5, kind="point"), segment(3, 5, 9)]
    with pytest.raises(InputError, match="no frame of it would be left"):
        apply(rows, {"kind": "move", "segment": 2, "onset": 12})
    with pytest.raises(InputError, match="no room"):
        apply(rows, {"kind": "move", "segment": 3, "onset": 4})
    moved = apply(rows[:2], {"kind": "move", "segment": 2, "onset": 6})
    assert (moved[1]["onset"], moved[1]["offset"]) == (6, 7)
    moved = apply(rows[:2], {"kind": "move", "segment": 2, "offset": 9, "onset": None})
    assert (moved[1]["onset"], moved[1]["offset"]) == (8, 9)
    with pytest.raises(InputError, match="expected a frame within"):
        apply(rows, {"kind": "split", "segment": 2, "frame": 5})
    with pytest.raises(InputError, match="a point"):
        apply(rows, {"kind": "merge", "segments": [1, 2]})
    # A neighbour's boundary does not stretch a point.
    assert apply(rows, {"kind": "move", "segment": 3, "onset": 7})[1] == rows[1]


def test_meanings_follow_a_label_or_go():
    rows = [
        segment(1, 0, 4, "NA", from_label="neutral", to_label="anger"),
        segment(2, 4, 8, "Ang", from_label="anger", to_label="anger"),
    ]
    joy = apply(rows, {"kind": "relabel", "segments": [1], "label": "J"})[0]
    assert (joy["from_label"], joy["to_label"]) == ("joy", "joy")
    fear = apply(rows, {"kind": "relabel", "segments": [1], "label": "AF"})[0]
    assert (fear["from_label"], fear["to_label"]) == ("anger", "fear")
    # A code that was renamed means what it means elsewhere in the tier.
    assert apply(rows, {"kind": "relabel", "segments": [1], "label": "Ang"})[0]["from_label"] == "anger"
    other = apply(rows, {"kind": "relabel", "segments": [1], "label": "blink"})[0]
    assert "from_label" not in other
    assert "to_label" not in other


def test_settling_continues_what_both_readers_said_beside_it():
    rows = [segment(1, 0, 5, "A", status="adjudicated"), segment(2, 8, 12, "A", status="adjudicated")]
    settled = apply(rows, {"kind": "settle", "onset": 5, "offset": 8, "label": "A"}, status="adjudicated")
    assert [(r["id"], r["onset"], r["offset"], r["status"]) for r in settled] == [(1, 0, 12, "adjudicated")]
    other = apply(rows, {"kind": "settle", "onset": 5, "offset": 8, "label": "J"}, status="adjudicated")
    assert [(r["label"], r["status"]) for r in other] == [
        ("A", "adjudicated"),
        ("J", "adjudicated"),
        ("A", "adjudicated"),
    ]
    nothing = apply(rows, {"kind": "settle", "onset": 4, "offset": 9, "label": None}, status="adjudicated")
    assert [(r["onset"], r["offset"]) for r in nothing] == [(0, 4), (9, 12)]


@pytest.mark.parametrize(
    ("operation", "message"),
    [
        ({"kind": "paint"}, "expected one of accept"),
        ({"kind": "accept"}, "'segments', but it is missing"),
        ({"kind": "accept", "segments": []}, "at least one segment"),
        ({"kind": "delete", "segments": [9]}, "segment 9: it is not in the tier"),
        ({"kind": "add", "onset": 3, "offset": 3, "label": "A"}, "at least one frame"),
        ({"kind": "add", "onset": 3, "offset": N + 1, "label": "A"}, f"the take, which has {N}"),
        ({"kind": "merge", "segments": [1]}, "two segments or more"),
        ({"kind": "merge", "segments": [1, 3]}, r"N \[4, 6\) lies between"),
        ({"kind": "relabel", "segments": [1], "label": "x" * 1001}, "at most 1000"),
        ({"kind": "relabel", "segments": [1], "label": "a\0"}, "NUL"),
        ({"kind": "relabel", "segments": [1], "label": "\ud800"}, "half a pair"),
        ({"kind": "relabel", "segments": [1], "label": 3}, "expected a text, but got int"),
    ],
)
def test_what_cannot_be_done_is_said(operation, message):
    rows = [segment(1, 0, 4), segment(2, 4, 6), segment(3, 6, 9)]
    with pytest.raises(InputError, match=message):
        apply(rows, operation)


@pytest.mark.parametrize("label", ["", " ", "😀", "../../etc/passwd", "<script>", "a\nb", "%00", "é" * 1000])
def test_odd_labels_are_labels(label):
    assert check_label(label) == label
    assert apply([], {"kind": "add", "onset": 0, "offset": 2, "label": label})[0]["label"] == label


def test_a_tier_in_place_of_another_keeps_what_is_the_same():
    rows = [segment(1, 0, 4, status="reviewed"), segment(2, 4, 6), segment(3, 6, 9)]
    new = [
        {"id": 50, "onset": 0, "offset": 4, "label": "N", "status": "proposed"},
        {"id": 2, "onset": 4, "offset": 7, "label": "N"},
        {"id": 60, "onset": 7, "offset": 9, "label": "J", "origin": "import"},
    ]
    change = replace_rows(rows, new, N, counter(), edited="reviewed")
    assert [row["id"] for row in change.removed] == [2, 3]
    assert change.added[0] == segment(2, 4, 7, status="reviewed", origin="human", revision=1)
    assert {"id": 60, "status": "proposed", "origin": "import", "revision": 0}.items() <= change.added[1].items()
    assert not replace_rows(rows, rows, N, counter())


@pytest.mark.parametrize(
    ("new", "message"),
    [
        ([{"onset": 0, "offset": 4, "label": "A"}, {"onset": 3, "offset": 5, "label": "A"}], "overlap"),
        ([{"onset": 0, "offset": N + 1, "label": "A"}], f"the take, which has {N}"),
    ],
)
def test_a_tier_that_is_none_is_refused(new, message):
    with pytest.raises(InputError, match=message):
        replace_rows([], new, N, counter())
