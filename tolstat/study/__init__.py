"""Studies and cases: the only reader of their TOML files."""

from tolstat.study.loading import load, load_case
from tolstat.study.study import Case, Study
from tolstat.study.subset_design import subset_of

__all__ = ["Case", "Study", "load", "load_case", "subset_of"]
