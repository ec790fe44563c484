"""Edits drafts in processes that may be killed: run as a program, one line on stdin begins each of them.

The modules are imported once and no corpus is opened before the fork, so that each process starts in no time.
"""

import os
import resource
import sys

from mimique.errors import CorpusError
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts.drafts import DraftKey

KEY = DraftKey("ab", "ab_IE_1")


def say(*words):
    print(*words, flush=True)


def add(drafts, number, version):
    operation = {"kind": "add", "tier": "affect", "onset": 2 * number, "offset": 2 * number + 1, "label": f"e{number}"}
    return drafts.edit(KEY, operation, request=f"request-{number}", version=version)


def edit_until_killed(folder, first):
    drafts = open_review(folder, owner="ab").drafts
    version = drafts.open(KEY).version
    for number in range(int(first), 600):
        version = add(drafts, number, version).version
        if number % 5 == 4:
            version = drafts.undo(KEY, request=f"undo-{number}", version=version).version
            version = drafts.redo(KEY, request=f"redo-{number}", version=version).version
        say("ack", number, version)


def edit_until_full(folder, room):
    review = open_review(folder, owner="ab")
    drafts, refusal = review.drafts, ""
    version = drafts.open(KEY).version
    log = review.database.path.with_name(review.database.path.name + "-wal")
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    resource.setrlimit(resource.RLIMIT_FSIZE, (log.stat().st_size + int(room), hard))
    number = 0
    while not refusal:
        try:
            version = add(drafts, number, version).version
            number += 1
        except CorpusError as error:
            refusal = str(error)
    seen = drafts.open(KEY).version
    resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
    after = add(drafts, number, version).version
    say("full", number, version, seen, after, repr(refusal))


if __name__ == "__main__":
    for line in sys.stdin:
        job, folder, number = line.rstrip("\n").split("\t")
        child = os.fork()
        if child == 0:
            {"kill": edit_until_killed, "full": edit_until_full}[job](folder, number)
            os._exit(0)
        say("process", child)
        os.waitpid(child, 0)
        say("ended")
