"""Servos that are told a position: the loop of their firmware identified together with the plant behind it.

runs -> closed form (weak_form) -> least squares of the free runs (fit) -> effects one by one (selection) -> held-out
confirmation -> intervals

terms lists what is tried, and which effects may act beside a loop; identify is the way without a diagnosis.
"""
