"""Random machine files, experiment calls and files of data, and what any of them must end in."""
