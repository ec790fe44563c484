"""Reference videos: in parts, and none that the corpus does not link."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.errors import InputError
from mimique.workbench.pipeline.linking import link_video
from mimique.workbench.review.showing.routes import router
from mimique.workbench.review.showing.videos import PIECE, parse_range

from .showing_app import make_client, make_review

SIZE = PIECE + 1234


@pytest.fixture
def place(tmp_path):
    corpus = Corpus.create(tmp_path / "corpus")
    with corpus.transaction("Add") as edit:
        edit.put_take("one", make_take(np.zeros((5, 1, 3)), ["a"], 100.0))
    data = np.random.default_rng(0).bytes(SIZE)
    for name in ("face é.mp4", "front.avi", "gone.webm", "passwd"):
        (tmp_path / name).write_bytes(data)
        link_video(Corpus.open(tmp_path / "corpus"), "one", tmp_path / name, folder=tmp_path / "corpus", rate=25.0)
    (tmp_path / "gone.webm").unlink()
    return tmp_path


@pytest.fixture
def client(place):
    return make_client(make_review(place / "corpus", place / "review"), router)


def ask(client, index=0, **headers):
    return client.get("/api/video", params={"take": "one", "index": index}, headers=headers)


def test_the_scene_lists_them_with_their_problems(client, place):
    videos = client.get("/api/scene", params={"take": "one"}).json()["videos"]
    assert [video["name"] for video in videos] == ["face é.mp4", "front.avi", "gone.webm", "passwd"]
    assert [video["index"] for video in videos] == [0, 1, 2, 3] and videos[0]["rate"] == 25.0
    problems = [video["problem"] for video in videos]
    assert problems[0] is None
    assert "browsers do not play" in problems[1] and "browsers do not play" in problems[3]
    assert problems[2].startswith("gone.webm: the video is not there") and str(place) not in str(videos)
    (place / "gone.webm").write_bytes((place / "passwd").read_bytes())
    assert client.get("/api/scene", params={"take": "one"}).json()["videos"][2]["problem"] is None


def test_all_of_it(client, place):
    answer = ask(client)
    assert answer.status_code == 200 and answer.headers["content-type"] == "video/mp4"
    assert answer.headers["accept-ranges"] == "bytes" and answer.headers["content-length"] == str(SIZE)
    assert answer.content == (place / "face é.mp4").read_bytes()


@pytest.mark.parametrize(
    ("header", "begin", "end"),
    [
        ("bytes=0-", 0, SIZE),
        ("bytes=0-0", 0, 1),
        ("bytes=100-199", 100, 200),
        ("bytes=-5", SIZE - 5, SIZE),
        ("bytes=-999999999", 0, SIZE),
        (f"bytes={SIZE - 1}-{SIZE * 9}", SIZE - 1, SIZE),
        ("Bytes = 7 - 9", 7, 10),
    ],
)
def test_a_part_of_it(client, place, header, begin, end):
    answer = ask(client, Range=header)
    assert answer.status_code == 206
    assert answer.headers["content-range"] == f"bytes {begin}-{end - 1}/{SIZE}"
    assert answer.headers["content-length"] == str(end - begin)
    assert answer.content == (place / "face é.mp4").read_bytes()[begin:end]


@pytest.mark.parametrize(
    "header", ["bytes=0-1,5-6", "bytes=5-2", "bytes=", "bytes=-", "lines=1-2", "bytes=x-", "", "-1"]
)
def test_other_ranges_are_left_aside(client, header):
    answer = ask(client, Range=header)
    assert answer.status_code == 200 and len(answer.content) == SIZE


@pytest.mark.parametrize("header", [f"bytes={SIZE}-", "bytes=99999999999-", "bytes=-0"])
def test_a_part_beyond_the_end_is_refused(client, header):
    answer = ask(client, Range=header)
    assert answer.status_code == 416 and answer.headers["content-range"] == f"bytes */{SIZE}"
    assert answer.json()["error"]["kind"] == "input"


@given(st.text(max_size=30) | st.from_regex(r"bytes=\d{0,25}-\d{0,25}", fullmatch=True), st.integers(1, 10**6))
def test_any_header_gives_a_part_within_the_file(header, size):
    try:
        part = parse_range(header, size)
    except InputError:
        return
    assert part is None or 0 <= part[0] < part[1] <= size


def test_what_the_browser_has_is_not_sent_again(client):
    tag = ask(client).headers["etag"]
    assert ask(client, **{"If-None-Match": tag}).status_code == 304
    assert ask(client, Range="bytes=0-9", **{"If-Range": tag}).status_code == 206
    assert ask(client, Range="bytes=0-9", **{"If-Range": '"another"'}).status_code == 200


@pytest.mark.parametrize(
    ("index", "status"), [(1, 422), (2, 422), (3, 422), (4, 404), (10**9, 404), (-1, 422), ("x", 422)]
)
def test_what_cannot_be_shown_is_refused(client, index, status, place):
    answer = ask(client, index)
    assert answer.status_code == status and str(place) not in answer.text


def test_a_changed_video_is_refused(client, place):
    (place / "face é.mp4").write_bytes(b"another")
    answer = ask(client)
    assert answer.status_code == 422 and "link it again" in answer.json()["error"]["message"]
