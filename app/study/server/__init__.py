"""The study's part of the web process: participants' pages, trials, the experimenter's desk.

It stands on `app.web` (sessions, workers, guard); the rest of `app.study` knows nothing of servers.
"""
