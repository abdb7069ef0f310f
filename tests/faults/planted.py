"""Programs that make one call each, which the tests let fail, and runs that were never made."""

import sys
from pathlib import Path
from typing import Any

from faults.commands import Command
from faults.kit import Run

LIBRARY = "import ctypes, os\nc = ctypes.CDLL(None, use_errno=True)\n"
"""Beginning of a program that calls the C library."""
OPENED = LIBRARY + "c.fopen.restype = ctypes.c_void_p\nf = ctypes.c_void_p(c.fopen(b'out.json', b'w'))\n"
"""Beginning of a program that writes to the stream `f`."""
_RAISE = "\nif {}: raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))"
CALLS = {
    "unlink": "import os; os.unlink('ends.json')",
    "unlinkat": "import os; os.unlink('ends.json', dir_fd=os.open('.', os.O_RDONLY))",
    "rmdir": "import os; os.rmdir('cache')",
    "remove": LIBRARY + "failed = c.remove(b'ends.json')" + _RAISE.format("failed"),
    "rmtree": "import shutil; shutil.rmtree('cache')",
    "rename": "import os; os.rename('ends.json', 'other.json')",
    "renameat": "import os; os.rename('ends.json', 'other.json', src_dir_fd=os.open('.', os.O_RDONLY))",
    "renameat2": LIBRARY + "failed = c.renameat2(-100, b'ends.json', -100, b'other.json', 0)" + _RAISE.format("failed"),
    "link": "import os; os.link('ends.json', 'other.json')",
    "linkat": "import os; os.link('ends.json', 'other.json', dst_dir_fd=os.open('.', os.O_RDONLY))",
    "symlink": "import os; os.symlink('ends.json', 'other.json')",
    "symlinkat": "import os; os.symlink('ends.json', 'other.json', dir_fd=os.open('.', os.O_RDONLY))",
    "mkdir": "import os; os.mkdir('new')",
    "truncate": "import os; os.truncate('ends.json', 1)",
    "chmod": "import os; os.chmod('ends.json', 0o600)",
    "fchmod": "import os; os.fchmod(os.open('ends.json', os.O_RDONLY), 0o600)",
    "fopen": OPENED + _RAISE.format("not f"),
}
"""Call -> program that makes only this call on its files, and gets an `OSError` if it fails."""
WRITES = {
    "fwrite": OPENED + "c.fwrite(b'[1, 2, 3]', 1, 9, f)",
    "fclose": OPENED + "c.fputs(b'[1, 2, 3]', f)\nc.fclose(f)",
    "fflush": OPENED + "c.fputs(b'[1, 2, 3]', f)\nc.fflush(f)",
}
"""Call -> program that does not notice that this call fails, its last one."""
ALLOCATIONS = {
    "malloc": "c.malloc.restype = ctypes.c_void_p\nfailed = c.malloc(100000) is None",
    "calloc": "c.calloc.restype = ctypes.c_void_p\nfailed = c.calloc(1000, 100) is None",
    "realloc": "c.realloc.restype = ctypes.c_void_p\nfailed = c.realloc(None, 100000) is None",
    "aligned_alloc": "c.aligned_alloc.restype = ctypes.c_void_p\nfailed = c.aligned_alloc(64, 100032) is None",
    "posix_memalign": "failed = c.posix_memalign(ctypes.byref(ctypes.c_void_p()), 64, 100000) != 0",
}


def python(program: str, *line: str) -> Command:
    """Returns a command that runs the text of a program."""
    return Command([*line], program=[sys.executable, "-c", program])


def made_run(folder: Path, **values: Any) -> Run:
    """Returns a run that left the files in a folder; it ended well unless `values` has other fields."""
    fields = {"command": Command([]), "code": 0, "out": "", "err": "", "calls": 0, "before": {}} | values
    return Run(folder=folder, **fields)
