"""The names of anatomical landmarks, how sure each can be found, and by what rule."""

from __future__ import annotations

PAIRED = {
    "eye_inner": ("high", "where the closing lids' gap ends towards the nose"),
    "eye_outer": ("high", "where the closing lids' gap ends towards the temple"),
    "lid_upper": ("high", "the edge of the lid that eyeBlink moves farthest"),
    "lid_lower": ("high", "where that edge arrives"),
    "brow_inner": ("fair", "above the inner eye corner, where the brow shapes move most"),
    "brow_mid": ("fair", "above the middle of the eye, where the brow shapes move most"),
    "brow_outer": ("fair", "above the outer eye corner, where the brow shapes move most"),
    "nose_ala": ("fair", "the skin beside the tip of the nose that looks sideways"),
    "nose_crease": ("fair", "where that wing meets the cheek"),
    "mouth_corner": ("high", "where smile, stretch and dimple pull most"),
    "cheek": ("low", "half way between eye and mouth corner, beside the nose's wing"),
    "cheekbone": ("low", "outside the outer eye corner, at half the height of the nose"),
    "jaw_corner": ("low", "on the jaw, a sixth of the face below the mouth"),
    "temple": ("low", "behind the outer end of the brow"),
    "ear": ("fair", "the skin farthest to the side between brow and nose"),
}
"""Landmarks on both sides: how sure, and by what rule; their names end in ``_left`` and ``_right``."""

MIDDLE = {
    "forehead": ("low", "half a nose's length above the brows"),
    "glabella": ("fair", "farthest forward between the brows"),
    "nasion": ("fair", "the deepest point between glabella and nose"),
    "nose_tip": ("high", "farthest forward between eyes and mouth"),
    "nose_base": ("high", "the corner between nose and upper lip"),
    "lip_upper_border": ("fair", "farthest forward on the upper lip"),
    "lip_upper": ("high", "the upper lip's edge, where jawOpen parts the lips"),
    "lip_lower": ("high", "the lower lip's edge, where jawOpen parts the lips"),
    "lip_lower_border": ("fair", "farthest forward on the lower lip"),
    "chin_fold": ("fair", "the deepest point between the lower lip and the chin's bottom"),
    "chin": ("fair", "farthest forward between that fold and the chin's bottom"),
    "chin_bottom": ("fair", "foremost on the chin, seen from half below"),
}
"""Landmarks on the midline."""

LANDMARKS: tuple[str, ...] = (*MIDDLE, *(f"{name}_{side}" for name in PAIRED for side in ("left", "right")))
"""All names that :func:`find_landmarks` knows."""
