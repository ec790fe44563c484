"""Parameters of the segmentation chosen on annotated takes, and other ways to cut."""
