"""What to record next, and what it would tell.

bench (explanations tried out) -> refits -> discriminating_inputs (what tells two apart) -> wording -> next_recording;
question (what pins parameters) -> optimal_input
"""
