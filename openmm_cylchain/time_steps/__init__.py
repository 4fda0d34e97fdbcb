"""Steps in time: schemes, precision, recommended steps, and what shows that a step is too long."""
