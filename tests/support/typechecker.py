"""The run-time type checker of the test runs: beartype, which accepts an int for a float."""

from beartype import BeartypeConf, beartype

checked = beartype(conf=BeartypeConf(is_pep484_tower=True))
