"""Parts of `mmp report`: reading a benchmark folder, statistics, tables, figures, and the page of it all."""
