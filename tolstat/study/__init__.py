"""Studies and cases: the only reader of their TOML files."""

from tolstat.study.file import load, load_case, subset_of
from tolstat.study.study import Given, Study

__all__ = ["Given", "Study", "load", "load_case", "subset_of"]
