"""The web process: pages, cookie, proxy, workers."""
