"""``tolstat allocate``: the cheapest tolerances that keep limits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, say, writing
from tolstat.cli.extend import StudyFile


def allocate(
    file: ResultFile,
    limit: Annotated[
        list[str],
        typer.Option("--limit", metavar="RULE", help='"P(cross*.F > 700 N) < 0.001"; repeat for more.'),
    ],
    costs: Annotated[
        Path | None,
        typer.Option("--costs", metavar="TABLE", help="TOML or CSV; default: a tolerance costs its reciprocal."),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option("--keep", metavar="PATTERN", help="Errors whose tolerances stay: pin*.diameter; repeat for more."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="STUDY", help="Study file to write, with the tolerances proposed.")
    ] = None,
    study_file: StudyFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Propose the cheapest tolerances with which limits are kept, from the joints of the file.

    Every entry of [tolerances] gets a factor. Half of the joints choose, by what they weigh under other tolerances; the
    other half judges the choice. Where the joints cannot tell, the verdict is "needs new runs", and what is proposed is
    a study to run next. A joint without a valid load counts as above the limits.
    """
    from tolstat.common.files import check_target
    from tolstat.display import text
    from tolstat.questions.allocate.query import allocated
    from tolstat.store import ResultStore
    from tolstat.study.scaling import line

    if out is not None:
        check_target(out, file)
    with ResultStore.open(file) as store:
        found = allocated(store.view(study_file), limit, costs, keep or ())
    if out is not None:
        content = found.text
        with writing(out) as temporary:
            temporary.write_text(content, encoding="utf-8")
    if as_json:
        w = found.weights
        head = {"holds": found.holds, "verdict": found.verdict, "aim": found.aim, "ess": w.ess}
        tables = {key: text.records(getattr(found, key)) for key in ("tolerances", "limits")}
        typer.echo(as_text({**head, "entries": found.entries, **tables}))
        return
    typer.echo(text.plain(found.tolerances))
    typer.echo(f"\n{text.plain(found.limits)}")
    if found.entries:
        typer.echo("\n[tolerances]\n" + "\n".join(line(*item) for item in found.entries.items()))
    before, after = found.tolerances["cost_before"].sum(), found.tolerances["cost"].sum()
    say(f"cost {before:.4g} -> {after:.4g} ({100 * (after / before - 1):+.1f} %)\n{found.verdict}")
    if out is not None:
        say(f"wrote {out}: run it with tolstat run {out}")
