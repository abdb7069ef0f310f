"""What happens around a search: the run and its result, shortcuts, LNS and path recombination."""
