"""The mechanics of a chain of cylinders: friction, potentials, redistribution of forces, tension, the flow around it."""
