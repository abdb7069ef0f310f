"""The console script `mmp`: one file per command."""
