"""What the review database keeps of double coding: the plan, who codes which take, and what they found."""

__all__ = ["SCHEMA"]

SCHEMA = """
CREATE TABLE IF NOT EXISTS coding_plan (
    only_one INTEGER PRIMARY KEY CHECK (only_one = 1),
    tier TEXT NOT NULL,
    share REAL NOT NULL,
    coders TEXT NOT NULL,
    coders_per_take INTEGER NOT NULL,
    seed INTEGER NOT NULL
);
CREATE TABLE IF NOT EXISTS coding (
    take TEXT NOT NULL,
    person TEXT NOT NULL,
    tier TEXT NOT NULL,
    done INTEGER NOT NULL DEFAULT 0,
    PRIMARY KEY (take, person)
);
CREATE TABLE IF NOT EXISTS coding_readings (
    take TEXT NOT NULL,
    person TEXT NOT NULL,
    tier TEXT NOT NULL,
    rows TEXT NOT NULL,
    PRIMARY KEY (take, person, tier)
);
"""
