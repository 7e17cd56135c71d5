"""Studies made with rotorsim: the claims of the thesis, and benchmarks. Not part of the installed packages."""
