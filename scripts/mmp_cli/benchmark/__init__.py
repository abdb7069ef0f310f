"""`mmp bench`: many instances x planners, each unit in a worker process, a line of results.jsonl for each."""
