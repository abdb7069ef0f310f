# mujoco ships compiled modules without types; to the type checker all that is in them is Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
