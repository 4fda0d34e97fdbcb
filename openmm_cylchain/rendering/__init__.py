"""Pictures and films of runs, drawn without a display by a ray caster of tubes."""
