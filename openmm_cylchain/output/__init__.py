"""What simulations write: reports and structure files."""
