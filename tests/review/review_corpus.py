"""A small simulated corpus to review: the avatar, short takes of two signers, a model's proposals."""

import atexit
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.synthesis.avatar import affect_pose, build_avatar, default_markers
from scipy.ndimage import uniform_filter1d

RATE = 200.0
MODEL = "forest"
LABELS = {"N": "neutral", "A": "anger", "D": "disgust", "F": "fear", "J": "joy", "Sa": "sadness", "Su": "surprise"}
TAKES = ("ab_IE_1", "ab_SE_2", "cd_IE_1")


def make_proposals(n_frames: int, rng: np.random.Generator, *, length: int = 150) -> pd.DataFrame:
    """Held labels with transitions between them, side by side, each with a confidence."""
    rows, frame, before = [], 0, None
    while frame + length // 2 < n_frames:
        label = str(rng.choice([name for name in LABELS if name != before]))
        if before is not None:
            rows.append((frame, frame + 30, before + label))
            frame += 30
        end = min(frame + int(rng.integers(length // 2, length * 2)), n_frames)
        rows.append((frame, end, label))
        frame, before = end, label
    table = pd.DataFrame(rows, columns=["onset", "offset", "label"]).query("offset <= @n_frames")
    return table.assign(confidence=rng.uniform(0.3, 0.99, len(table)), status="proposed", origin="model")


def make_review_corpus(
    folder: Path, *, takes: tuple[str, ...] = TAKES, n_frames: int = 1600, weights: bool = True, seed: int = 0
) -> Corpus:
    """Make the corpus; the faces follow the proposals, whatever these are worth."""
    rng = np.random.default_rng(seed)
    rig, places = build_avatar(), default_markers()
    names, vertices = list(places), np.array(list(places.values()))
    corpus = Corpus.create(folder, name="review", author="test")
    with corpus.transaction("Add takes", author="test") as edit:
        edit.put_rig("avatar", rig.to_dataset())
        for take in takes:
            table = make_proposals(n_frames, rng)
            curves = np.zeros((n_frames, rig.n_shapes))
            for row in table.itertuples():
                if row.label in LABELS:
                    curves[row.onset : row.offset] = affect_pose(LABELS[row.label])
            curves = uniform_filter1d(curves, 25, axis=0)
            position = rig.neutral[vertices] + np.einsum("fs,svc->fvc", curves, rig.deltas[:, vertices])
            edit.put_take(take, make_take(position, names, RATE, signer=take[:2], protocol=take[3:5], simulated=True))
            if weights:
                residual = rng.gamma(2.0, 0.2, n_frames)
                residual[300:320] += 6.0
                edit.put_weights(take, curves, shapes=rig.shapes, residual=residual, rig="avatar", method="map")
                adapted = xr.Dataset(
                    {"position": (("time", "marker", "space"), position)},
                    {"marker": names, "space": list("xyz")},
                    {"rig": "avatar"},
                )
                edit.put_processed(take, "adapted-avatar-map", adapted)
            edit.put_tier(take, "affect", table, author=MODEL, provenance={"step": "label"})
    return corpus


_TEMPLATES: dict[tuple, Path] = {}


def copy_review_corpus(folder: Path, **facts) -> Path:
    """Make the same corpus as :func:`make_review_corpus`, by copying one that this process made before."""
    key = tuple(sorted(facts.items()))
    if key not in _TEMPLATES or not _TEMPLATES[key].is_dir():
        place = Path(tempfile.mkdtemp(prefix="mimique-review-corpora-"))
        atexit.register(shutil.rmtree, place, ignore_errors=True)
        _TEMPLATES[key] = make_review_corpus(place / "corpus", **facts).path
    shutil.copytree(_TEMPLATES[key], folder)
    return folder
