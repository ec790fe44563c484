"""What people touch: the command line, the pipeline behind it, reports, the demo."""
