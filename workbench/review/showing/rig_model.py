"""A rig as the file that the page draws: glTF binary, in metres, its morph targets in the order of the rig's shapes."""

from __future__ import annotations

from pathlib import Path

from ....corpus.store.view import CorpusView
from ....synthesis import Rig
from ....synthesis.gltf_writing import write_gltf
from ...pipeline.rig_colours import find_colours
from .made_files import MadeFiles, make_key

__all__ = ["find_rig_model", "model_key"]

FORM = 1
"""Rises when the same rig makes another file."""


def model_key(corpus: CorpusView, rig: str) -> str:
    """Return the fingerprint of a rig's file.

    Raises
    ------
    NotFoundError
        If there is no such rig.
    """
    return make_key(model=corpus.fingerprint(None, "rig", rig), form=FORM)


def find_rig_model(files: MadeFiles, corpus: CorpusView, rig: str) -> tuple[str, Path]:
    """Return the fingerprint and the ``.glb`` file of a rig, which is made where it is not there yet.

    Raises
    ------
    NotFoundError
        If there is no such rig.
    RigError
        If it cannot be written as glTF.
    CorpusError
        If the folder of files cannot be written.
    """
    key = model_key(corpus, rig)

    def make(path: Path) -> None:
        found = Rig.from_dataset(corpus.rig(rig))
        write_gltf(path, found, colours=find_colours(found))

    return key, files.find(key, ".glb", make)
