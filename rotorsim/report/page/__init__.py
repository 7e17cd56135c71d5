"""Pages of reports: blocks, units, style of figures, HTML, and files of figures."""
