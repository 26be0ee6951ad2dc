"""Tables of what a joint costs, as text."""

from __future__ import annotations

from tolstat.benchmarks import machine
from tolstat.benchmarks.cost.iteration import Iteration
from tolstat.benchmarks.cost.others import Comparison
from tolstat.benchmarks.cost.rates import Rates
from tolstat.benchmarks.cost.run import Cost
from tolstat.benchmarks.cost.scaling import Scale
from tolstat.benchmarks.cost.split import Split
from tolstat.benchmarks.cost.startup import Startup
from tolstat.display.text import align


def text(found: Cost) -> str:
    """Compose all tables, each with its title."""
    sections = [
        (_rates_title(found.rates), _rates(found.rates)),
        ("Where the time of a joint goes, µs", _parts(found.iteration)),
        ("Rate of operations, and ratios to dense linear algebra", _ratios(found.iteration)),
        ("Workers", _scaling(found.scaling)),
        ("Start-up", _startup(found.startup)),
    ]
    if found.others is not None:
        sections.append((_others_title(found.others), _others(found.others)))
    parts = [
        f"{found.study}: {machine.text(found.machine)}",
        *(f"{title}\n\n{align(rows)}" for title, rows in sections),
    ]
    return "\n\n".join(parts)


def _rates_title(rates: Rates) -> str:
    return (
        f"{rates.joints} joints on one core, {rates.settled} settled; dynamic: {rates.revolutions:.3g} revolutions,\n"
        f"{rates.steps:.4g} steps, {rates.iterations:.4g} Newton iterations ({rates.iterations_per_step:.3g} a step), "
        f"{rates.factorisations:.3g} tangents, {rates.halvings:.2g} halvings"
    )


def _rates(rates: Rates) -> list[list[str]]:
    return [
        ["", "ms a joint", "joints/s", "speed, one at a time = 1", "speed, in lanes = 1"],
        ["dynamic, in lanes", *_two(rates.lanes_ms, rates.lanes_per_second), f"{rates.lanes_ratio:.3g}", "1"],
        ["dynamic, one at a time", *_two(rates.alone_ms, rates.alone_per_second), "1", f"{1 / rates.lanes_ratio:.3g}"],
        [
            "quasi-static",
            *_two(rates.quasistatic_ms, rates.quasistatic_per_second),
            f"{rates.quasistatic_ratio_alone:.3g}",
            f"{rates.quasistatic_ratio:.3g}",
        ],
    ]


def _two(ms: float, per_second: float) -> list[str]:
    return [f"{ms:.3g}", f"{per_second:.4g}"]


def _parts(of: Iteration) -> list[list[str]]:
    rows = [["part", "in lanes", "share", "one execution", "alone", "share", "one execution"]]
    for name in of.lanes.joint_us._fields:
        row = [name]
        for split in (of.lanes, of.alone):
            spent, once = getattr(split.joint_us, name), getattr(split.once_us, name)
            row += [f"{spent:.1f}", f"{100 * spent / sum(split.joint_us):.0f} %", f"{once:.3f}"]
        rows.append(row)
    whole = ["all"]
    for split in (of.lanes, of.alone):
        whole += [f"{sum(split.joint_us):.1f}", "100 %", ""]
    return [*rows, whole, ["a Newton iteration", *_each(of.lanes), *_each(of.alone)]]


def _each(split: Split) -> list[str]:
    return [f"{split.iteration_us:.2f}", "", ""]


def _ratios(of: Iteration) -> list[list[str]]:
    against = of.dense
    return [
        ["", "in lanes", "alone"],
        ["operations a second, 1e9", f"{of.lanes.gflops:.3g}", f"{of.alone.gflops:.3g}"],
        [
            f"share of the core's peak rate, {of.peak_gflops:.4g}e9",
            f"{100 * of.lanes.share_of_peak:.1f} %",
            f"{100 * of.alone.share_of_peak:.1f} %",
        ],
        [f"lanes filled, of {of.width}", f"{100 * of.lanes_filled:.1f} %", ""],
        [
            f"Newton iteration with LAPACK ({against.lapack_us:.3g} µs a system), time over ours",
            f"{against.iteration_ratio_lanes:.3g}",
            f"{against.iteration_ratio:.3g}",
        ],
        [
            "the same, tangents reused as in a joint",
            f"{against.kept_ratio_lanes:.3g}",
            f"{against.kept_ratio:.3g}",
        ],
        [
            f"LAPACK's factorisation and solution, time over ours ({against.structured_us:.3g} µs)",
            "",
            f"{against.solver_ratio:.3g}",
        ],
    ]


def _scaling(scales: list[Scale]) -> list[list[str]]:
    rows = [["workers", "joints/s", "efficiency", "by CPU time", "MB a worker", "growth, MB"]]
    for scale in scales:
        rows.append(
            [
                str(scale.workers),
                f"{scale.per_second:.4g}",
                f"{scale.efficiency:.3g}",
                f"{scale.cpu_efficiency:.3g}",
                f"{scale.worker_mb:.4g}",
                f"{scale.growth_mb:.2g}",
            ]
        )
    return rows


def _startup(found: Startup) -> list[list[str]]:
    rows = [
        ["", "s", "CPU time, s"],
        ["tolstat --help", f"{found.help_s:.2f}", ""],
        ["first joint, kernels in the cache", f"{found.first_joint_s:.2f}", f"{found.first_joint_cpu_s:.2f}"],
    ]
    for name, seconds, cpu in (
        ("dynamic", found.cold_s, found.cold_cpu_s),
        ("quasi-static", found.cold_quasistatic_s, found.cold_quasistatic_cpu_s),
    ):
        if seconds is not None and cpu is not None:
            rows.append([f"compilation for {name} joints", f"{seconds:.0f}", f"{cpu:.0f}"])
    return rows


def _others_title(found: Comparison) -> str:
    return f"Cheapest setting whose error of the largest loads is at most {found.error:g} in all {found.joints} joints"


def _others(found: Comparison) -> list[list[str]]:
    rows = [["", "setting", "ms a joint", "error", "time over ours in lanes", "with the study's steps"]]
    for one in found.contenders:
        met = one.error is not None
        rows.append(
            [
                one.name,
                f"{one.setting:g}" if met else "none met",
                f"{one.ms:.3g}" if met else f"> {one.ms:.3g}",
                f"{one.error:.1e}" if met else "-",
                f"{one.ratio:.3g}" if met else f"> {one.ratio:.3g}",
                f"{one.ratio_default:.3g}" if met else f"> {one.ratio_default:.3g}",
            ]
        )
    return rows
