"""What the review database keeps of people: accounts, sessions (of which only hashes), settings."""

__all__ = ["SCHEMA"]

SCHEMA = """
CREATE TABLE IF NOT EXISTS accounts (
    person TEXT PRIMARY KEY,
    password TEXT NOT NULL,
    is_lead INTEGER NOT NULL,
    is_active INTEGER NOT NULL DEFAULT 1
);
CREATE TABLE IF NOT EXISTS sessions (
    hash TEXT PRIMARY KEY,
    person TEXT NOT NULL,
    is_named INTEGER NOT NULL,
    seen REAL NOT NULL
);
CREATE TABLE IF NOT EXISTS settings (
    person TEXT PRIMARY KEY,
    settings TEXT NOT NULL
);
"""
