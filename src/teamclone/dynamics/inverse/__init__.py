"""The commands of a match from its game log alone: the effects of each worked out backwards."""
