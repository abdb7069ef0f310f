"""Recordings read back: the rows of each entity and component, by timeline."""

from collections import defaultdict

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader


class Rows:
    """All rows of a recording. Times on duration timelines are in seconds."""

    def __init__(self, path):
        self._static = defaultdict(dict)
        self._timed = defaultdict(list)
        for chunk in RrdReader(str(path)).stream():
            batch = chunk.to_record_batch()
            columns = {name: batch.column(name) for name in batch.schema.names}
            for name, column in columns.items():
                if ":" not in name:
                    continue
                key = chunk.entity_path, name
                if chunk.is_static:
                    self._static[chunk.entity_path][name] = column[-1].as_py()
                for timeline in chunk.timeline_names:
                    times = _numbers(columns[timeline])
                    self._timed[(*key, timeline)] += list(zip(times, column.to_pylist(), strict=True))

    @property
    def entities(self):
        """Paths of all entities."""
        return {path for path, *_ in self._timed} | set(self._static)

    @property
    def timelines(self):
        """Names of all timelines."""
        return {timeline for *_, timeline in self._timed}

    def static(self, entity, component):
        """Returns the one value for all times."""
        return self._static[entity][component]

    def statics(self, component):
        """Returns entity -> its one value for all times, of all entities with the component."""
        return {entity: values[component] for entity, values in self._static.items() if component in values}

    def at(self, entity, component, timeline):
        """Returns time -> value. The last of several rows at one time counts."""
        return {time: value for time, value in self._timed[entity, component, timeline] if value is not None}


def blueprints(path):
    """Returns the number of blueprints in a recording."""
    return len(RrdReader(str(path)).blueprints())


def blueprint_values(path):
    """Returns component -> its values anywhere in the layout of a recording."""
    reader, out = RrdReader(str(path)), defaultdict(list)
    for chunk in reader.stream(store=reader.blueprints()[0]):
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if ":" in name:
                out[name] += [value for row in batch.column(name).to_pylist() for value in row or []]
    return out


def array(value):
    """Returns a list of vectors as an array."""
    return np.array(value, dtype=float)


def _numbers(times):
    if not pa.types.is_duration(times.type):
        return times.to_pylist()
    return (times.cast(pa.int64()).to_numpy() * 1e-9).tolist()
