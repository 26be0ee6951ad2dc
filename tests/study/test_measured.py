"""Entries that are known from measured parts: what they draw and leave open, and what is no part of the identity."""

import numpy as np
import pytest

from tests.support import synthetic
from tolstat import study
from tolstat.common.errors import InputError
from tolstat.study.assumptions import assumptions, together, with_value
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
    ],
)
def test_what_cannot_be_known_is_refused_with_the_reason(tmp_path, text, found):
    with pytest.raises(InputError, match=found):
        load(tmp_path, text)


def test_values_of_one_process_are_those_of_all_its_errors(tmp_path):
    plan = load(tmp_path, KNOWN)
    *_, spread, mean = assumptions(plan)
    assert (spread.name, mean.name) == ("spread of pin*.offset_t", "mean of pin*.offset_t")
    assert (spread.because, mean.varied) == ("30 parts measured", True)
    keys = together(plan, [spread.values[1], mean.values[0]])
    changed, plain = with_value(plan, keys).tolerances, plan.tolerances["pin1.offset_t"]
    wider, moved = spread.values[1]["pin*.offset_t.spread"], mean.values[0]["pin*.offset_t.mean"]
    assert wider > 1.0 > 0.0 > moved
    assert changed["pin1.offset_t"] == Normal(plain.mean + moved * plain.sigma, wider * plain.sigma)
    assert all(changed[f"pin{k}.offset_t"] == changed["pin1.offset_t"] for k in (2, 3, 4))
    assert with_value(plan, keys).joint == plan.joint


def test_of_a_lognormal_law_the_logarithm_is_open(tmp_path):
    (tmp_path / "parts.csv").write_text("d\n" + "\n".join(str(1.0 + v) for v in VALUES), encoding="utf-8")
    plan = load(tmp_path, entry('law = "lognormal", unit = "mm", file = "parts.csv", column = "d"'))
    keys = {"pin*.offset_t.spread": 2.0, "pin*.offset_t.mean": 0.5}
    log, changed = plan.tolerances["pin1.offset_t"].log, with_value(plan, keys).tolerances["pin1.offset_t"].log
    assert changed == Normal(log.mean + 0.5 * log.sigma, 2.0 * log.sigma)


def test_of_accepted_parts_those_made_are_open(tmp_path):
    position = (
        '"pin*.position" = { zone = "⌀0.1 mm", over = "22 mm", distribution = "normal", material_condition = "reject" }'
    )
    diameter = ENTRY.replace("offset_t", "diameter").replace("0.1 mm", "0.03 mm").replace("cpk", "known_from = 9, cpk")
    plan = load(tmp_path, synthetic.STUDY.replace(ENTRY, f"{position}\n{diameter}"))
    changed = with_value(plan, {"pin*.diameter.spread": 2.0}).tolerances["pin1.diameter"]
    assert changed.every == Normal(0.0, 2.0 * plan.tolerances["pin1.diameter"].every.sigma)
    assert changed.share < plan.tolerances["pin1.diameter"].share
