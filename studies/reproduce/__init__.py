"""Published results computed again, figure by figure, each with a verdict that follows from a stated rule."""
