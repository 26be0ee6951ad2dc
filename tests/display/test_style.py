"""Style of figures: marks of axes."""

import io

import pytest
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from tolstat.display import style


@pytest.mark.parametrize(("low", "high"), [(0.5 / 1024, 1.0), (1e-3, 1.0), (0.5 / 1000, 1.0), (2e-5, 0.4)])
def test_marks_that_are_not_made_would_not_be_drawn(low, high):
    drawn, marks = [], []
    for every in (False, True):
        with style.settings():
            figure = Figure(figsize=(4.0, 3.0))
            ax = figure.subplots()
            style.share_axis(ax, low, high=high)
            if every:
                ax.yaxis.set_minor_locator(LogLocator(subs=None))
            stream = io.StringIO()
            figure.savefig(stream, format="svg", metadata={"Date": None})
        drawn.append(stream.getvalue())
        marks.append(len(ax.yaxis.get_minor_ticks()))
    assert drawn[0] == drawn[1]
    assert marks[0] < marks[1]
