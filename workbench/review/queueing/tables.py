"""What the review database keeps of people's working time; bounded, however long a review goes on."""

__all__ = ["SCHEMA"]

SCHEMA = """
CREATE TABLE IF NOT EXISTS activity (
    person TEXT NOT NULL,
    take TEXT NOT NULL,
    seconds REAL NOT NULL,
    turn INTEGER NOT NULL,
    moment TEXT NOT NULL,
    PRIMARY KEY (person, take)
);
CREATE TABLE IF NOT EXISTS pace (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    person TEXT NOT NULL,
    seconds REAL NOT NULL,
    reviewed INTEGER NOT NULL
);
CREATE INDEX IF NOT EXISTS pace_of_person ON pace (person, number);
"""
