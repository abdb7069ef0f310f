# Installed in an environment of its own only (extra dm); to the type checker all that is in it is Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
