"""The run around a search and its result, and the improvement of plans: shortcuts, LNS, path recombination."""
