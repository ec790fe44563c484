"""Removing a person from all history of a corpus.

The whole history is made again in a new folder without what is theirs (see :mod:`.replay`), checked, and
put in the old one's place in one step, all under the corpus's lock; then the old folder is deleted. Whenever this is
interrupted, either the old corpus stands whole or the new one does; the next run clears away what was left.

Clones, backups and files that were exported elsewhere are out of reach.
"""

from __future__ import annotations

import secrets
import shutil
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import icechunk

from ...errors import CorpusError, InputError, MimiqueError, NotFoundError
from ..store.corpus import Corpus
from ..store.layout import decode_name, encode_reference
from ..store.library_view import enumerate_names
from ..store.locking import LOCAL_FOLDER, describe_error, lock_corpus
from ..store.repository import MAIN_BRANCH, commit_metadata, list_branches, list_tags, open_repository
from ..store.unit_paths import describe_unit, kind_of_unit
from .folder_swap import exchange_folders
from .personal_data import PersonalData, find_personal_data, order_snapshots
from .personal_files import ICECHUNK_ENTRIES, clean_beside, copy_extra_files, review_beside
from .redaction import Redactor
from .replay import Replay
from .tombstones import hash_code, was_forgotten, write_tombstone

__all__ = ["Forgetting", "forget", "leftover_folder", "plan_forgetting"]

KINDS = ("model", "prior", "rig")


@dataclass(frozen=True)
class Forgetting:
    """What goes when a signer is forgotten.

    Parameters
    ----------
    takes
        Names of the signer's takes, of all times and branches.
    models, priors, rigs
        Names of what was learned from them, or bears their code.
    others
        What goes in the takes of others, since a model or rig of theirs made it, in words.
    renamed
        Branches and tags whose names name the signer.
    ambiguous
        Takes that bear the code in their name, but are not recorded as this signer's: they stay.
    unread
        Entries of the folder that are not the repository's and were carried over unread; known after it was done.
    has_record
        Whether there was a record of the signer.
    snapshots
        How many snapshots are made again.
    """

    takes: tuple[str, ...]
    models: tuple[str, ...]
    priors: tuple[str, ...]
    rigs: tuple[str, ...]
    others: tuple[str, ...]
    renamed: tuple[str, ...]
    ambiguous: tuple[str, ...]
    has_record: bool
    snapshots: int
    unread: tuple[str, ...] = ()

    def describe(self) -> list[str]:
        """Say what goes, a line each."""
        lines = [f"{len(self.takes)} takes with all that belongs to them: {enumerate_names(list(self.takes))}"]
        for what in ("models", "priors", "rigs"):
            names: tuple[str, ...] = getattr(self, what)
            if names:
                lines.append(f"{what}: {enumerate_names(list(names))}")
        if self.others:
            lines.append(f"derived from these, in takes of others: {enumerate_names(list(self.others))}")
        if self.has_record:
            lines.append("the signer's record")
        if self.renamed:
            lines.append(f"renamed: {enumerate_names(list(self.renamed))}")
        lines.append("their names in messages and parameters of commits, and finished work kept beside the corpus")
        lines.append("what the review page keeps of their takes: edits, published or not, and pictures")
        if self.ambiguous:
            lines.append(
                f"NOT: {enumerate_names(list(self.ambiguous))}, which bear the code but are not recorded as theirs"
            )
        return lines


def leftover_folder(path: Path) -> Path:
    """Return where the history is made again; the folder is there only while that goes on, or was interrupted."""
    return path.parent / f".{path.name}-forgetting"


def plan_forgetting(corpus: Corpus, signer: str) -> Forgetting:
    """Return what would go, and change nothing.

    Raises
    ------
    NotFoundError
        If nothing in the whole history is the signer's.
    """
    data = _find(corpus._repository, corpus, signer)
    return _describe(data, corpus._repository, corpus)


def forget(
    corpus: Corpus,
    signer: str,
    *,
    author: str | None = None,
    on_snapshot: Callable[[int], object] = lambda total: None,
    purge_review: Callable[[PersonalData, Redactor], object] | None = None,
) -> Forgetting:
    """Remove a signer from all history: takes, what was derived and learned from them, their record and their names.

    Every snapshot gets a new id; its message, author and time stay (in its metadata), branches and tags too. A
    tombstone says when, by whom and how much was forgotten, and what each old id became. Other programs that have
    the corpus open must open it again; what they have not committed by then is refused.

    Parameters
    ----------
    corpus
        Any version of it; afterwards it shows the newest of its branch, or of the main branch.
    signer
        The code.
    author
        Who does this.
    on_snapshot
        Called with the number of snapshots after each one is made again.
    purge_review
        Deletes what the corpus's review keeps of the signer; called once the new history is ready. Who reviews keeps
        edits beside the corpus, in tables that belong together, which only the review can tell apart.

    Returns
    -------
    Forgetting
        What went.

    Raises
    ------
    NotFoundError
        If nothing is the signer's, or they were forgotten already; what an interrupted run left is cleared then too.
    CorpusError
        If the corpus is locked, or the new one cannot be written or is not what it should be; the old one stands then.
        If there are edits of a review, and nothing was given that purges them.
    """
    if not isinstance(corpus.path, Path):
        raise CorpusError(
            f"{corpus.path}: a signer can only be forgotten in a folder, since nothing can be renamed in S3; "
            "copy the corpus to a disk, forget there, copy it to a new address and delete the old one"
        )
    path = corpus.path.resolve()
    building = leftover_folder(path)
    review = review_beside(path)
    if purge_review is None and review.exists():
        raise CorpusError(
            f"{review}: holds edits, and shows, of this corpus's takes; run 'mimique forget', which goes through them"
        )
    try:
        with lock_corpus(path, timeout=corpus._lock_timeout, purpose="forget a signer"):
            shutil.rmtree(building, ignore_errors=True)
            repository = open_repository(path)
            data = _find(repository, corpus, signer)
            done = _describe(data, repository, corpus)
            replacement = f"forgotten-{secrets.token_hex(3)}"
            redactor = data.redactor(replacement)
            target = icechunk.Repository.create(icechunk.local_filesystem_storage(str(building)))
            replay = Replay(repository, target, data, redactor)
            heads = _heads(repository)
            replay.run(heads, lambda: on_snapshot(done.snapshots))
            _check_copy(replay, heads, path)
            _write_references(repository, replay)
            _leave_tombstone(replay, data, done, author)
            leave = ICECHUNK_ENTRIES - {"config.yaml"} | {LOCAL_FOLDER}
            unread = copy_extra_files(path, building, redactor, leave=leave)
            shutil.copymode(path, building)
            clean_beside(path, redactor)
            if purge_review is not None:
                purge_review(data, redactor)
            # Who waits for the lock looks for its file by name, and from the exchange on finds this one.
            with lock_corpus(building, purpose="forget a signer"):
                exchange_folders(path, building)
                shutil.rmtree(building)
    except (icechunk.IcechunkError, OSError) as error:
        if isinstance(error, MimiqueError):
            raise
        raise CorpusError(f"{path}: the signer could not be forgotten: {describe_error(error)}") from error
    finally:
        shutil.rmtree(building, ignore_errors=True)
    at = corpus.branch if corpus.branch in list_branches(open_repository(path)) else None
    corpus.__dict__.update(Corpus.open(corpus.path, at=at, lock_timeout=corpus._lock_timeout).__dict__)
    return Forgetting(**{**done.__dict__, "unread": tuple(unread)})


def _find(repository: icechunk.Repository, corpus: Corpus, signer: str) -> PersonalData:
    if not isinstance(signer, str) or not signer.strip():
        raise InputError("forget: expected the code of a signer, but it is empty")
    data = find_personal_data(repository, _heads(repository), signer)
    if not (data.recordings or data.learned or data.has_record):
        main = repository.readonly_session(branch=encode_reference(MAIN_BRANCH)).store
        stone = was_forgotten(main, signer)
        if stone is not None:
            raise NotFoundError(f"{corpus.path}: signer {signer!r} was forgotten on {stone['time'][:10]} already")
        known = sorted({str(code) for code in corpus.takes()["signer"].dropna()})
        raise NotFoundError(
            f"{corpus.path}: no signer {signer!r} in all history; there are {enumerate_names(known)} now"
        )
    return data


def _heads(repository: icechunk.Repository) -> dict[str, str]:
    branches = {f"branch {name}": snapshot for name, snapshot in list_branches(repository).items()}
    return branches | {f"tag {name}": snapshot for name, snapshot in list_tags(repository).items()}


def _describe(data: PersonalData, repository: icechunk.Repository, corpus: Corpus) -> Forgetting:
    redactor = data.redactor("")
    heads = _heads(repository)
    learned = {kind: tuple(sorted(_name(u) for u in data.learned if kind_of_unit(u) == kind)) for kind in KINDS}
    return Forgetting(
        takes=tuple(sorted(data.takes)),
        models=learned["model"],
        priors=learned["prior"],
        rigs=learned["rig"],
        others=tuple(describe_unit(unit) for unit in sorted(data.others)),
        renamed=tuple(sorted(name for name in heads if redactor.finds(name.partition(" ")[2]))),
        ambiguous=tuple(data.ambiguous_takes),
        has_record=data.has_record,
        snapshots=len(order_snapshots(repository, heads)),
    )


def _name(unit: str) -> str:
    return decode_name(unit.split("/")[1])


def _check_copy(replay: Replay, heads: dict[str, str], path: Path) -> None:
    for name, snapshot in heads.items():
        wrong = replay.compare(snapshot)
        if wrong:
            raise CorpusError(
                f"{path}: {name}: the new history is not what it should be ({enumerate_names(wrong, 3)}); "
                "nothing was changed; run 'mimique verify' first"
            )


def _write_references(repository: icechunk.Repository, replay: Replay) -> None:
    """Give the new repository the branches and tags of the old one."""
    taken: set[str] = set()

    def choose(name: str) -> str:
        chosen = name if name == MAIN_BRANCH else replay.redactor.text(name)
        while chosen in taken:
            chosen = f"{chosen}-{uuid.uuid4().hex[:6]}"
        taken.add(chosen)
        return encode_reference(chosen)

    for name, snapshot in list_branches(repository).items():
        new = replay.successors[snapshot]
        if name == MAIN_BRANCH:
            replay.target.reset_branch(choose(name), new)
        else:
            replay.target.create_branch(choose(name), new)
    for name, snapshot in list_tags(repository).items():
        replay.target.create_tag(choose(name), replay.successors[snapshot])
    replay.finish()


def _leave_tombstone(replay: Replay, data: PersonalData, done: Forgetting, author: str | None) -> None:
    session = replay.target.writable_session(MAIN_BRANCH)
    salt = secrets.token_bytes(16)
    metadata = commit_metadata("forget", {"takes": len(done.takes)}, author=author, base=session.snapshot_id)
    facts = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "author": metadata["author"],
        "takes": len(done.takes),
        "models": len(done.models) + len(done.priors),
        "salt": salt.hex(),
        "hash": hash_code(data.signer, salt),
    }
    write_tombstone(session.store, facts, replay.successors)
    session.commit(f"Forget a signer ({len(done.takes)} takes)", metadata)
