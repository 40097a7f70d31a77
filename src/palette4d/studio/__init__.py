"""Studio, the editor: a model in plain Python (session, player, preview, display), and views."""
