"""Borders of faces that move where the tier says, but for some that were moved: they must be put back."""

import numpy as np
import pandas as pd
from mimique.models.mistakes.border_regression import describe_borders, place_borders

RATE = 50.0


def test_moved_borders_are_put_back() -> None:
    rng = np.random.default_rng(2)
    described, moved, true = [], [], []
    for _ in range(14):
        rows, curve, onset, pose = [], [], 0, np.zeros(3)
        for step in range(6):
            rows.append((onset, onset + 60, "n" if step % 2 == 0 else "j"))
            curve.append(np.repeat(pose[None], 60, axis=0))
            onset += 60
            if step < 5:
                after = np.eye(3)[0] if step % 2 == 0 else np.zeros(3)
                rows.append((onset, onset + 20, "x"))
                curve.append(pose + np.linspace(0, 1, 20)[:, None] * (after - pose))
                onset, pose = onset + 20, after
        table = pd.DataFrame(rows, columns=["onset", "offset", "label"])
        weights = np.concatenate(curve) + 0.01 * rng.standard_normal((onset, 3))
        right = table["onset"].to_numpy()[1:].copy()
        table.loc[3, "offset"] += 12
        table.loc[4, "onset"] += 12
        moves = (table["label"] == "x").to_numpy()
        nothing = np.zeros((onset, 0))
        described.append(describe_borders(table, moves, weights, nothing, nothing, ()))
        moved.append(table["onset"].to_numpy()[1:])
        true.append(right)
    found = place_borders(described, ["IE"] * 14, [RATE] * 14, np.arange(14) % 2, rng=rng)
    fitted = np.array([table["fitted"] for table in found])
    assert np.abs(fitted - np.array(true)).max() < 8
    place = 3
    assert np.abs(fitted[:, place] - np.array(true)[:, place]).mean() < 0.5 * 12
    assert all((table["expected"] > 0).all() for table in found)


def test_too_few_borders_say_nothing() -> None:
    table = pd.DataFrame({"onset": [0, 50], "offset": [50, 100], "label": ["a", "b"]})
    own = describe_borders(table, np.zeros(2, bool), np.zeros((100, 2)), np.zeros((100, 1)), np.zeros((100, 0)), ())
    (found,) = place_borders([own], ["IE"], [RATE], np.zeros(1, dtype=np.int64), rng=np.random.default_rng(0))
    assert found["fitted"].isna().all()
    assert found["onset"].tolist() == [50]
