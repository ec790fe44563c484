"""Scores of labels: per frame, per segment, of borders; agreement; intervals; what a confidence is worth."""
