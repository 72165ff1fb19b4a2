"""What a reader sees: pages that stand alone, their figures, and words for numbers.

style -> drawing -> traces, maps, *_figures (inline SVG)
display (numbers and units) -> page (its parts) -> *_report (one a command: the whole page)
"""
