"""What is decided, by numbers alone: thresholds -> explained -> ordering -> acceptance -> confirmation -> verdict.

Nothing here simulates, fits or knows an effect by name, so that every decision can be replayed on tables of what it
read (analysis/golden.py). Every threshold stands in ``thresholds.Policy``, with its unit, what it protects and how it
was set.
"""
