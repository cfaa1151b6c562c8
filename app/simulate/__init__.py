"""Simulated users and whole simulated studies."""
