"""The mechanics of a chain of cylinders: friction, potentials, redistribution of forces, tension, flow."""
