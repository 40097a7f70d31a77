"""The command `palette4d`. Each verb is one module."""
