"""Clips in, frames and movies out."""
