"""The command `palette4d`: one module a verb."""
