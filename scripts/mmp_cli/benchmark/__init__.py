"""`mmp bench`: runs instances with planners in worker processes, and writes a line of results.jsonl for each run."""
