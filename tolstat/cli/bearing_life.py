"""``tolstat bearing-life``: rating life of the needle bearings on the pins."""

from __future__ import annotations

import textwrap

import typer

from tolstat.cli._app import AsJson, ResultPath, Wide, as_text, print_table
from tolstat.cli._talk import progress, say


def bearing_life(file: ResultPath, wide: Wide = False, as_json: AsJson = False) -> None:
    """Print the rating life of the pins' bearings.

    Prints the life that 50, 90 and 99 % of the joints reach, for each bearing and for all four together, the share of
    the joints that do not reach the required life, each with its 95 % interval, the dynamic equivalent loads, and how
    the bearings are loaded.

    The bearings are those of [bearing] in the joint file, or of [joint.bearing] in the study. To change them, edit the
    file and repeat tolstat run: no joint is simulated again. With contact.law = "needles" the keys needles and
    needle_length are part of the campaign: to change them, run the study into another file.

    Example: tolstat bearing-life needle_bearings.h5
    """
    from tolstat.display.table import WIDTH
    from tolstat.questions.bearing_life import query, rendering
    from tolstat.questions.bearing_life.lives import lives_of
    from tolstat.store import ResultFile

    with progress("lives"), ResultFile.open(file) as store:
        view = store.view()
        lives = lives_of(view)
        if as_json:
            typer.echo(as_text(query.summary(view, 0.95)["bearing_life"]))
            return
        quantiles, below, contacts = query.quantiles(lives), query.below(lives), query.contacts(view)
    table = rendering.by_place(quantiles)
    first, *others = rendering.verdict(lives, below, quantiles)
    typer.echo(first if wide else textwrap.fill(first, WIDTH))
    if lives.unrated < lives.valid:
        typer.echo(f"\nlife {lives.bearing.symbol} that a share of the joints reaches")
        print_table(rendering.LIVES, table, wide)
        if len(below):
            typer.echo(f"\njoints that do not reach {rendering.hours(lives.required)}")
            print_table(rendering.BELOW, below, wide)
    typer.echo("\ndynamic equivalent load P, which a share of the joints stays below")
    print_table(rendering.LOADS, rendering.of_pins(table), wide)
    if len(contacts):
        typer.echo("\njoints in which a bearing is loaded so for more than half of a revolution")
        print_table(rendering.CONTACTS, contacts, wide)
    say("\n".join([*others, *rendering.notes(lives, contacts)]))
