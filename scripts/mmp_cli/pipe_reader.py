"""Reader of the messages of another process that never waits for the rest of a message."""

from __future__ import annotations

import os
import struct
from multiprocessing.connection import wait

_CHUNK_BYTES = 1 << 20
_SHORT, _LONG = struct.Struct("!i"), struct.Struct("!Q")


class PipeReader:
    """Complete messages of a `multiprocessing.connection.Connection`, from its file descriptor.

    A process that stops in the middle of a message does not block the reader.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._bytes = descriptor, bytearray()

    def next(self) -> bytes | None:
        """Returns the next message that has arrived completely, or None. Does not wait.

        Raises:
            EOFError: if the other end is closed and no complete message is left.
            OSError: if the pipe cannot be read.
            ValueError: if the bytes are not messages.
        """
        while (message := self._complete()) is None:
            if not wait([self._descriptor], timeout=0):
                return None
            chunk = os.read(self._descriptor, _CHUNK_BYTES)
            if not chunk:
                raise EOFError
            self._bytes += chunk
        return message

    def _complete(self) -> bytes | None:
        """Returns the first message. `Connection.send_bytes` puts its length before it: 4 bytes, or -1 and 8 bytes."""
        head = _SHORT.size
        if len(self._bytes) < head:
            return None
        (size,) = _SHORT.unpack_from(self._bytes)
        if size == -1:
            head += _LONG.size
            if len(self._bytes) < head:
                return None
            (size,) = _LONG.unpack_from(self._bytes, _SHORT.size)
        if size < 0:
            raise ValueError(f"a message of {size} bytes")
        if len(self._bytes) < head + size:
            return None
        message = bytes(self._bytes[head : head + size])
        del self._bytes[: head + size]
        return message
