"""The tables that keep drafts: what each started from, every edit, and which requests were answered."""

__all__ = ["SCHEMA"]

SCHEMA = """
-- start: fingerprint of the tiers that an unedited draft shows; edited ones keep their rows in draft_tiers.
-- head: number of the last edit that is applied; length: of the last that could be redone.
-- published: number that was the head when the draft last was as the corpus is; common: how many of the edits up to
-- there are still part of the draft (fewer after an undo and another edit).
CREATE TABLE IF NOT EXISTS drafts (
    draft INTEGER PRIMARY KEY,
    person TEXT NOT NULL,
    take TEXT NOT NULL,
    purpose TEXT NOT NULL CHECK (purpose IN ('own', 'adjudication')),
    base TEXT NOT NULL,
    recording TEXT NOT NULL,
    frames INTEGER NOT NULL,
    start TEXT NOT NULL,
    edited INTEGER NOT NULL DEFAULT 0,
    version INTEGER NOT NULL DEFAULT 1,
    head INTEGER NOT NULL DEFAULT 0,
    length INTEGER NOT NULL DEFAULT 0,
    published INTEGER NOT NULL DEFAULT 0,
    common INTEGER NOT NULL DEFAULT 0,
    UNIQUE (person, take, purpose)
);
CREATE INDEX IF NOT EXISTS drafts_by_take ON drafts (take);

-- known: the author's own tier in the corpus when the draft started or was last as the corpus is; NULL for no tier.
CREATE TABLE IF NOT EXISTS draft_tiers (
    draft INTEGER NOT NULL REFERENCES drafts (draft),
    tier TEXT NOT NULL,
    source TEXT,
    inputs TEXT NOT NULL,
    columns TEXT NOT NULL,
    rows TEXT NOT NULL,
    known TEXT,
    PRIMARY KEY (draft, tier)
);

-- cut: undone, then overtaken by another edit; kept for the history. made: for show alone, a clock may be set back.
CREATE TABLE IF NOT EXISTS edits (
    edit INTEGER PRIMARY KEY AUTOINCREMENT,
    draft INTEGER NOT NULL REFERENCES drafts (draft),
    number INTEGER NOT NULL,
    kind TEXT NOT NULL,
    operation TEXT NOT NULL,
    changes TEXT NOT NULL,
    cut INTEGER NOT NULL DEFAULT 0,
    made TEXT NOT NULL
);
CREATE UNIQUE INDEX IF NOT EXISTS edits_in_order ON edits (draft, number) WHERE cut = 0;

-- What was about to be committed: the draft's rows then, and what the tier became of them. Gone once the draft knows.
CREATE TABLE IF NOT EXISTS publications (
    draft INTEGER NOT NULL REFERENCES drafts (draft),
    tier TEXT NOT NULL,
    columns TEXT NOT NULL,
    rows TEXT NOT NULL,
    outcome TEXT NOT NULL,
    PRIMARY KEY (draft, tier)
);

CREATE TABLE IF NOT EXISTS requests (
    request TEXT PRIMARY KEY,
    draft INTEGER NOT NULL REFERENCES drafts (draft),
    step TEXT NOT NULL CHECK (step IN ('edit', 'undo', 'redo')),
    edit INTEGER NOT NULL REFERENCES edits (edit),
    version INTEGER NOT NULL,
    undo TEXT,
    redo TEXT,
    unpublished INTEGER NOT NULL
);
"""
