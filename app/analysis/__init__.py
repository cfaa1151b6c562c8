"""From trials to measures, statistics, figures and a report."""
