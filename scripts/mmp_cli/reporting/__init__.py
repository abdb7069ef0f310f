"""What `mmp report` is made of: reading a benchmark folder, statistics, tables, figures, and the page of it all."""
