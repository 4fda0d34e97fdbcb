"""The tables of a configuration: for each kind its keys, and what they are read into."""
