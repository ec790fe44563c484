"""What the page shows of a take: the face, its weights, markers and curves, the reference video."""
