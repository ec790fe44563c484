"""The report of a layout study: HTML page, A4 pages, pictures, placement sheet."""
