"""``/api/scene``, ``/api/rig``, ``/api/weights``, ``/api/markers``, ``/api/curve`` and ``/api/video``.

Numbers are sent as they lie in memory: float32, little endian, row by row. NaN is what is not known.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Depends, Header, Query, Response
from fastapi.responses import StreamingResponse
from numpy.typing import NDArray

from ....corpus import Corpus
from ....errors import InputError
from ..context import Review
from ..server.dependencies import Person, get_person, get_review
from ..server.errors import Refusal, refusals
from .curves import read_curve
from .messages import Problem, Scene
from .rig_model import find_rig_model
from .scene import corpus_folder
from .showing import Showing, check_shown, find_showing
from .videos import MEDIA_TYPES, find_video, parse_range, read_part

__all__ = ["LARGEST_COUNT", "router"]

LARGEST_COUNT = 8192
"""Frames of one answer: 1.7 MB of 51 shapes."""

LAST_FRAME = 2**31 - 1

router = APIRouter(tags=["showing"])

ReviewHere = Annotated[Review, Depends(get_review)]
Somebody = Annotated[Person, Depends(get_person)]
Take = Annotated[str, Query(description="Name of the take.")]
Solve = Annotated[str | None, Query(description="Name of the solve; the take's current one if left out or empty.")]
First = Annotated[int, Query(ge=0, le=LAST_FRAME, description="First frame.")]
Count = Annotated[int, Query(ge=1, le=LARGEST_COUNT, description="Frames; fewer are sent at the end of the take.")]
Known = Annotated[str | None, Header(alias="If-None-Match")]


class Numbers(Response):
    """Numbers as bytes."""

    media_type = "application/octet-stream"


class Model(Response):
    """A face as glTF binary."""

    media_type = "model/gltf-binary"


def _bytes_of(description: str, *media_types: str) -> dict[str, Any]:
    binary = {"schema": {"type": "string", "format": "binary"}}
    return {"description": description, "content": dict.fromkeys(sorted(set(media_types)), binary)}


_NUMBERS = {200: _bytes_of("float32, little endian", "application/octet-stream"), **refusals(401, 403, 404, 422, 503)}


@router.get("/api/scene", responses=refusals(401, 403, 404, 422, 503))
def get_scene(review: ReviewHere, person: Somebody, take: Take, solve: Solve = None) -> Scene:
    """Return what the page needs to know of a take."""
    corpus, showing = _open(review, take)
    scene = showing.scene(corpus, take, solve or None)
    problem = scene.problem
    if problem is not None:  # the scene is shared by all who ask
        command = None if problem.command is None else review.without_places(problem.command)
        problem = Problem(message=review.without_places(problem.message), command=command)
    return scene.model_copy(update={"problem": problem})


@router.get(
    "/api/rig",
    response_class=Model,
    responses={
        200: _bytes_of("glTF 2.0 binary, metres", "model/gltf-binary"),
        304: {"description": "Not Modified"},
        **refusals(401, 404, 422, 503),
    },
)
def get_rig(
    review: ReviewHere, person: Somebody, rig: Annotated[str, Query(description="Name.")], known: Known = None
) -> Response:
    """Return a rig as glTF; its morph targets are the rig's shapes, in their order and by their names."""
    key, path = find_rig_model(find_showing(review).files, review.corpus(), rig)
    # A rig is put once and asked for at every opening: the browser keeps it, and asks whether it is still the same.
    headers = {"ETag": f'"{key}"', "Cache-Control": "private, no-cache"}
    if known is not None and f'"{key}"' in known:
        return Response(status_code=304, headers=headers)
    return Model(path.read_bytes(), headers=headers)


@router.get("/api/weights", response_class=Numbers, responses=_NUMBERS)
def get_weights(
    review: ReviewHere, person: Somebody, take: Take, first: First, count: Count, solve: Solve = None
) -> Response:
    """Return (frames, shapes) weights of the rig's shapes, 0 at rest and 1 at full."""
    corpus, showing = _open(review, take)
    return _send(showing.weights(corpus, take, solve or None).read(first, count))


@router.get("/api/markers", response_class=Numbers, responses=_NUMBERS)
def get_markers(
    review: ReviewHere, person: Somebody, take: Take, first: First, count: Count, solve: Solve = None
) -> Response:
    """Return (frames, markers, 3) positions in the rig's space, mm; nothing where the scene names no markers."""
    corpus, showing = _open(review, take)
    markers = showing.markers(corpus, take, solve or None)
    return _send(np.empty(0) if markers is None else markers.read(first, count))


@router.get("/api/curve", response_class=Numbers, responses=_NUMBERS)
def get_curve(
    review: ReviewHere,
    person: Somebody,
    take: Take,
    curve: Annotated[str, Query(description="Name: one of the scene's curves, or a shape of its rig.")],
    solve: Solve = None,
) -> Response:
    """Return (frames,) one curve over the whole take."""
    corpus, showing = _open(review, take)
    return _send(read_curve(showing.files, showing.weights(corpus, take, solve or None), curve))


@router.get(
    "/api/video",
    response_class=StreamingResponse,
    responses={
        200: _bytes_of("The whole file", *MEDIA_TYPES.values()),
        206: _bytes_of("The part that was asked for", *MEDIA_TYPES.values()),
        304: {"description": "Not Modified"},
        **refusals(401, 403, 404, 416, 422, 503),
    },
)
def get_video(
    review: ReviewHere,
    person: Somebody,
    take: Take,
    index: Annotated[int, Query(ge=0, le=LAST_FRAME, description="Place among the take's videos.")],
    wanted: Annotated[str | None, Header(alias="Range")] = None,
    known: Known = None,
    only_if: Annotated[str | None, Header(alias="If-Range")] = None,
) -> Response:
    """Return a linked video, or the one part of it that the Range header names."""
    corpus, _ = _open(review, take)
    video = find_video(corpus, take, index, corpus_folder(corpus))
    tag = f'"{video.digest}"'
    headers = {"Accept-Ranges": "bytes", "ETag": tag, "Cache-Control": "private, no-cache"}
    if known is not None and tag in known:
        return Response(status_code=304, headers=headers)
    if only_if is not None and only_if.strip() != tag:  # the part belongs to what was there before
        wanted = None
    try:
        part = parse_range(wanted, video.size)
    except InputError as error:
        raise Refusal(416, "input", str(error), {"Content-Range": f"bytes */{video.size}"}) from error
    begin, end = part or (0, video.size)
    headers["Content-Length"] = str(end - begin)
    if part is not None:
        headers["Content-Range"] = f"bytes {begin}-{end - 1}/{video.size}"
    return StreamingResponse(
        read_part(video.path, begin, end),
        status_code=200 if part is None else 206,
        headers=headers,
        media_type=video.media_type,
    )


def _send(values: NDArray[Any]) -> Numbers:
    return Numbers(np.ascontiguousarray(values, dtype="<f4").tobytes())


def _open(review: Review, take: str) -> tuple[Corpus, Showing]:
    """Return the newest corpus and what is known of showing it, once the take may be shown."""
    corpus = review.corpus()
    check_shown(corpus, take)
    return corpus, find_showing(review)
