"""Entries that are known from measured parts: what they draw, what is refused, and what is no part of the identity."""

import numpy as np
import pytest

from tests.support import synthetic
from tolstat import study
from tolstat.common.errors import InputError
from tolstat.study.tolerances.distributions import LogNormal, Normal

KNOWN = synthetic.STUDY.replace("cpk = 1.0 }", "cpk = 1.0, known_from = 30 }")
ENTRY = '"pin*.offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }'
VALUES = [0.012, -0.004, 0.007, 0.001, 0.003, -0.002]


def load(folder, text):
    path = folder / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return study.load(path)


def entry(keys):
    return synthetic.STUDY.replace(ENTRY, f'"pin*.offset_t" = {{ distribution = "measured", {keys} }}')


def test_parts_are_no_part_of_the_identity(tmp_path):
    plain, some = load(tmp_path, synthetic.STUDY), load(tmp_path, KNOWN)
    assert some.identity() == plain.identity()
    assert plain.known == ()
    (found,) = some.known
    assert (found.pattern, found.parts, len(found.names)) == ("pin*.offset_t", 30, 4)


def test_a_sample_with_a_law_has_its_mean_and_deviation(tmp_path):
    found = load(tmp_path, entry(f'law = "normal", unit = "mm", values = {VALUES}'))
    values = 1e-3 * np.array(VALUES)
    assert found.tolerances["pin2.offset_t"] == Normal(pytest.approx(values.mean()), pytest.approx(values.std(ddof=1)))
    assert found.known[0].parts == len(VALUES)
    (tmp_path / "parts.csv").write_text("d\n" + "\n".join(str(1.0 + v) for v in VALUES), encoding="utf-8")
    of_file = load(tmp_path, entry('law = "lognormal", unit = "mm", file = "parts.csv", column = "d"'))
    assert isinstance(of_file.tolerances["pin1.offset_t"], LogNormal)
    assert of_file.known[0].parts == len(VALUES)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (
            entry(f'unit = "mm", values = {[0.01 * k for k in range(30)]}'),
            "lies beyond all of them with probability 86 %",
        ),
        (entry('law = "normal", unit = "mm", values = [0.1, 0.2]'), "2 parts are too few for a law"),
        (entry(f'law = "lognormal", unit = "mm", values = {VALUES}'), "not above zero"),
        (entry('law = "normal", unit = "mm", values = [1.0, 1.0, 1.0, 1.0, 1.0]'), "all measured values are equal"),
        (entry('law = "normal", unit = "mm"'), "needs either file and column, or values"),
        (KNOWN.replace("known_from = 30", "known_from = 3"), "known_from"),
        (KNOWN.replace("known_from = 30", "known_from = 30, truncate = true"), "of parts that are sorted"),
        (KNOWN.replace("n = 60", 'n = 64\nmethod = "sobol"'), "needs independent joints, not 'sobol'"),
        (KNOWN + '[[correlation]]\nbetween = ["pin*.offset_t"]\nrho = 0.5\n', "is correlated"),
    ],
)
def test_what_cannot_be_known_is_refused_with_the_reason(tmp_path, text, found):
    with pytest.raises(InputError, match=found):
        load(tmp_path, text)
