"""What a reader sees: pages that stand alone, their figures, and words for numbers.

display (numbers and units) -> page (its parts) -> *_report (one a command: the whole page)
a diagnosis: thinning -> charts (block of data and script/*.js) -> diagnosis_charts, drawn by the page itself
the other pages: style -> drawing -> traces, maps, *_figures (inline SVG by matplotlib)
"""
