"""``tolstat selective``: pins and holes sorted in classes; yield and unmatched parts by number of classes."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, Wide, Workers, as_text, make_folder, output_folder, print_table
from tolstat.cli._talk import progress, say


def selective(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML) with sampling.selective.")],
    classes: Annotated[
        list[int] | None,
        typer.Option(
            "--classes", metavar="K", min=1, max=20, help="Number of classes; repeatable; default: 1, 2, 3 and 5."
        ),
    ] = None,
    n: Annotated[int | None, typer.Option("--n", metavar="N", min=1, help="Number of joints of each.")] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for result files and figure; default: the current one.")
    ] = Path(),
    workers: Workers = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print yield and unmatched parts of selective assembly.

    Pins and holes are measured and sorted in classes; crosses and forks of equal class are assembled. Simulates one
    campaign for each number of classes, with the same seed, into STUDY_kK.h5; 1 is without sorting. To resume after an
    interruption, run the same command again.

    Prints for each the share of the parts without a partner, the scatter of the clearance, and the yield of the
    assembled joints with its 95 % interval. Writes a figure beside the files.

    Example: tolstat selective studies/selective.toml --classes 1 --classes 3
    """
    from matplotlib.figure import Figure

    from tolstat.cli import run
    from tolstat.display import style, text
    from tolstat.questions.selective import query, rendering
    from tolstat.store import ResultFile

    plans = [query.study_of(study_file, number, n) for number in sorted(set(classes or query.CLASSES))]
    make_folder(out)
    paths = []
    for plan in plans:
        assert plan.sampling.selective is not None
        paths.append(out / f"{study_file.stem}_k{plan.sampling.selective.classes}.h5")
        run.simulate(plan, paths[-1], workers=workers)
    with progress("selective assembly"), ExitStack() as opened:
        found = query.assembled([opened.enter_context(ResultFile.open(path)).view() for path in paths])
    with output_folder(out), style.settings():
        figure = Figure(figsize=(7.0, 3.6), layout="constrained")
        rendering.draw(figure.add_subplot(), found)
        files = style.save(figure, out / f"{study_file.stem}_selective")
    if as_json:
        typer.echo(as_text({"classes": text.records(found.table)}))
        return
    print_table(rendering.COLUMNS, found.table, wide)
    say(rendering.NOTE)
    for path in files:
        say(f"wrote {path}")
