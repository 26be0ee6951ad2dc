"""Tables, loads and channels of the Cardan joint, for tests that are about it."""

from __future__ import annotations

from functools import partial

from tolstat.common import channels as of_channels
from tolstat.common import columns as of_columns
from tolstat.common import loads as of_loads
from tolstat.common import tables as of_tables
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import kinds, places, spans
from tolstat.common.mechanism import features

ERROR_FIELDS, RESULT_FIELDS, ERROR, PARAM, RESULT, KERNEL_RESULT = of_tables.tables(CARDAN)
HOLES = tuple(name for name in features(CARDAN) if name.startswith("hole"))
PLACES, KIND, SPAN = places(CARDAN), kinds(CARDAN), spans(CARDAN)
LOAD_KINDS = tuple(KIND.values())
BUSHINGS, PINS, SHAFTS = KIND["F"].places, KIND["contact"].places, KIND["axial"].places
LOADS, SHOWN_LOADS = of_loads.loads_of(CARDAN), of_loads.shown_loads(CARDAN)
LOAD_FIELDS, PANELS = of_loads.load_fields(CARDAN), of_loads.panels(CARDAN)
UNIT_OF_LOAD, UNIT_OF_LIMIT = of_loads.units_of_loads(CARDAN), of_loads.units_of_limits(CARDAN)
LOAD_HISTORIES = tuple(of_channels.load_histories(CARDAN).values())
BUSHING_LOADS, SHAFT_LOADS = LOAD_HISTORIES
CHANNELS, COMPONENTS = of_channels.channels(CARDAN), of_channels.components(CARDAN)
PLANES = of_channels.planes(CARDAN)
ERROR_COLUMNS, RESULT_COLUMNS = of_columns.error_columns(CARDAN), of_columns.result_columns(CARDAN)
RESULT_NAMES = tuple(column.name for column in RESULT_COLUMNS)
OPTIONAL_FIELDS = tuple(dict.fromkeys(column.field for column in of_columns.optional_columns(CARDAN)))

Limit = partial(of_loads.Limit, mechanism=CARDAN)
load_of = partial(of_loads.load_of, mechanism=CARDAN)
names_of = partial(of_loads.names_of, mechanism=CARDAN)
limits_in_words = partial(of_loads.limits_in_words, mechanism=CARDAN)
largest = partial(of_loads.largest, mechanism=CARDAN)
put_largest = partial(of_loads.put_largest, mechanism=CARDAN)
signals_of = partial(of_channels.signals_of, mechanism=CARDAN)
unit_of = partial(of_channels.unit_of, mechanism=CARDAN)
histories_of = partial(of_channels.histories_of, mechanism=CARDAN)
kept_names = partial(of_columns.kept_names, mechanism=CARDAN)
kept_columns = partial(of_columns.kept_columns, mechanism=CARDAN)
blank_others = partial(of_columns.blank_others, mechanism=CARDAN)
without_results = partial(of_tables.without_results, mechanism=CARDAN)
for_kernels = partial(of_tables.for_kernels, mechanism=CARDAN)
blank_params = partial(of_tables.blank_params, mechanism=CARDAN)
