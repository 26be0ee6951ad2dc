"""Studies and cases: the only reader of their TOML files."""

from tolstat.study.file import load, load_case, subset_of
from tolstat.study.study import Study

__all__ = ["Study", "load", "load_case", "subset_of"]
