"""Forces between filaments and on them: crosslinks, contacts, walls, pulling."""
