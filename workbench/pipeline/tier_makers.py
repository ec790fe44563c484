"""Who made a tier: a person, or a machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

__all__ = ["MACHINE", "REVIEW_STEP", "SEGMENT_TIER", "came_by_review", "is_machine_made"]

SEGMENT_TIER = "segments"
"""Name of the tier of cuts that no label was given to."""

MACHINE = "mimique"
"""Author of what is computed without learning."""

REVIEW_STEP = "review"
"""What the provenance of a tier says that a person made on the review page."""


def is_machine_made(provenance: Mapping[str, Any], table: pd.DataFrame) -> bool:
    """Return whether a model labelled a tier: here, or before it came in as a file.

    What a person reviewed is theirs, also where every single proposal was right.

    Parameters
    ----------
    provenance, table
        Of the tier.
    """
    by_person = came_by_review(provenance)
    if by_person and (table["status"] != "proposed").any():
        return False
    if provenance and not by_person:
        return True
    return bool(len(table)) and bool((table["origin"] == "model").all())


def came_by_review(provenance: Mapping[str, Any]) -> bool:
    """Return whether a tier was published from the review page; a merge of two accounts is, where one of them is."""
    merged = provenance.get("merged")
    if isinstance(merged, list):
        return any(isinstance(one, Mapping) and came_by_review(one) for one in merged)
    return provenance.get("step") == REVIEW_STEP
